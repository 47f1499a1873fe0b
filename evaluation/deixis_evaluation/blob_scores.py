"""Scores of the tracker: how many faces and hands it finds, and how many hands it makes up."""

from __future__ import annotations

from dataclasses import dataclass, field

from .clips import TrueFrame, TruePerson, Truth
from .matching import MIN_FACE_PX, MIN_HAND_PX, finds_face, finds_hand, is_false_hand
from .recording import Recording


@dataclass(frozen=True)
class Recall:
    """How many of the things that are there were found."""

    found: int = 0
    total: int = 0

    def __add__(self, other: Recall) -> Recall:
        return Recall(self.found + other.found, self.total + other.total)

    @property
    def share(self) -> float | None:
        """Found by total; none where there was nothing to find."""
        return self.found / self.total if self.total else None


@dataclass(frozen=True)
class BlobScores:
    """Recall over frames (see matching.DEFINITION), and hand tracks on nobody's hand."""

    faces: Recall = field(default_factory=Recall)
    raised_hands: Recall = field(default_factory=Recall)
    hands: Recall = field(default_factory=Recall)
    false_hands: int = 0
    frames: int = 0

    def __add__(self, other: BlobScores) -> BlobScores:
        return BlobScores(
            self.faces + other.faces,
            self.raised_hands + other.raised_hands,
            self.hands + other.hands,
            self.false_hands + other.false_hands,
            self.frames + other.frames,
        )

    @property
    def false_hands_per_frame(self) -> float | None:
        """Hand tracks on nobody's hand, by frame."""
        return self.false_hands / self.frames if self.frames else None


def score_blobs(truth: Truth, recording: Recording) -> BlobScores:
    """Score the tracks of all frames of a clip. A frame that the tracker did not answer has no tracks."""
    return sum((_score_frame(truth, frame, recording) for frame in truth.frames), BlobScores())


def _score_frame(truth: Truth, frame: TrueFrame, recording: Recording) -> BlobScores:
    scores = BlobScores(false_hands=_false_hands(truth, frame, recording), frames=1)
    for person in frame.persons:
        scores += _score_person(truth, person, recording, frame.frame)
    return scores


def _false_hands(truth: Truth, frame: TrueFrame, recording: Recording) -> int:
    return sum(is_false_hand(track, frame.persons, truth) for track in recording.tracks_at(frame.frame))


def _score_person(truth: Truth, person: TruePerson, recording: Recording, frame: int) -> BlobScores:
    tracks = recording.tracks_at(frame)
    face, raised, hands = Recall(), Recall(), Recall()
    if person.face.visible_px >= MIN_FACE_PX:
        face = Recall(int(any(finds_face(track, person, truth) for track in tracks)), 1)
    width_px = truth.face_width_px(person)
    for side, hand in person.hands.sides():
        if not hand.in_frame or hand.visible_px < MIN_HAND_PX or hand.centroid_visible_px is None:
            continue
        found = Recall(int(any(finds_hand(track, hand, f"{side}_hand", width_px) for track in tracks)), 1)
        hands += found
        if side == person.raised:
            raised += found
    return BlobScores(face, raised, hands)
