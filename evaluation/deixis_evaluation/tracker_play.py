"""Plays a clip to the tracker's core alone, in this process, and puts its tracks beside the truth."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from deixis_schemas.messages import Producer, Track, Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import FrameRefused, Tracker

from .blob_scores import BlobScores, score_blobs
from .clips import Clip, ClipError, TrueFrame, TruePerson, Truth
from .matching import finds_face, finds_hand
from .proportion import Proportion
from .recording import Recording
from .replay import INSTANCE, Given, Picture, ReplayError

FAR_FACE_WIDTHS = 1.0
OnTracks = Callable[[Picture, TrueFrame, Sequence[Track]], None]
"""Is told of each frame when it is played: the picture, the truth of it, and what the tracker says."""


@dataclass(frozen=True)
class TrackerScore:
    """One clip. false_faces: face tracks on nobody, over all frames; sides: of the raised hands that are found as whichever
    hand, those called rightly; switches: times at which the person on a true face became another; cpu_ms: a frame.
    """

    name: str
    kind: str
    frames: int
    blobs: BlobScores = field(default_factory=BlobScores)
    false_faces: int = 0
    sides: Proportion = field(default_factory=lambda: Proportion(0, 0))
    switches: int = 0
    cpu_ms: float = 0.0
    failure: str | None = None


def evaluate_tracker(clip: Clip, config: TrackerConfig, on_tracks: OnTracks) -> TrackerScore:
    """Play one clip; what goes wrong with it stands in the score's `failure`."""
    truth = clip.truth
    try:
        recording, cpu_ms = play_tracker(clip, config, on_tracks)
    except (ClipError, ReplayError) as error:
        return TrackerScore(clip.name, truth.meta.kind, len(truth.frames), failure=str(error))
    return TrackerScore(
        clip.name,
        truth.meta.kind,
        len(truth.frames),
        score_blobs(truth, recording),
        sum(count_false_faces(truth, frame, recording.tracks_at(frame.frame)) for frame in truth.frames),
        score_sides(truth, recording),
        count_switches(truth, recording),
        cpu_ms,
    )


def play_tracker(clip: Clip, config: TrackerConfig, on_tracks: OnTracks) -> tuple[Recording, float]:
    """Its tracks of each frame, and the processor's time a frame, ms. Raises ClipError or ReplayError."""
    given, recording, tracker = Given(clip), Recording(), Tracker(config)
    spent_s = 0.0
    for frame, picture in given.pictures():
        begun_s = time.process_time()
        try:
            tracks = tracker.update(picture, frame.run, frame.stamp_ns)
        except FrameRefused:
            tracks = []  # as the stage's shell answers
        spent_s += time.process_time() - begun_s
        height, width = picture.shape[:2]
        said = Tracks.derive(frame, Producer("tracker", INSTANCE), width=width, height=height, tracks=tracks)
        recording.add(said, frame.stamp_ns)
        on_tracks(picture, clip.truth.frames[frame.seq], tracks)
    return recording, 1e3 * spent_s / max(1, len(clip.truth.frames))


def count_false_faces(truth: Truth, frame: TrueFrame, tracks: list[Track]) -> int:
    """Face tracks farther than a face width from every head of the frame."""

    def is_near(track: Track, person: TruePerson) -> bool:
        return math.dist(track.centroid_px, person.head.center_px) <= FAR_FACE_WIDTHS * truth.face_width_px(person)

    faces = [track for track in tracks if track.kind == "face"]
    return sum(not any(is_near(track, person) for person in frame.persons) for track in faces)


def score_sides(truth: Truth, recording: Recording) -> Proportion:
    """How many of the raised hands that are found have the right name."""
    right = []
    for frame in truth.frames:
        tracks = recording.tracks_at(frame.frame)
        for person in frame.persons:
            hands = dict(person.hands.sides())
            if person.raised is None:
                continue
            hand, width_px = hands[person.raised], truth.face_width_px(person)
            kinds = {side: any(finds_hand(track, hand, f"{side}_hand", width_px) for track in tracks) for side in hands}
            if any(kinds.values()):
                right.append(kinds[person.raised])
    return Proportion.of(right)


def count_switches(truth: Truth, recording: Recording) -> int:
    """How often the tracked person on a true face became another."""
    last: dict[int, int] = {}
    switches = 0
    for frame in truth.frames:
        for person in frame.persons:
            found = [track for track in recording.tracks_at(frame.frame) if finds_face(track, person, truth)]
            if len(found) == 1 and found[0].person_id is not None:
                switches += last.get(person.id, found[0].person_id) != found[0].person_id
                last[person.id] = found[0].person_id
    return switches
