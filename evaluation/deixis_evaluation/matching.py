"""Which track is which true face or hand, and which tracked person is which true one. Decided by position alone."""

from __future__ import annotations

import math
from collections import Counter

from deixis_schemas.messages import Track

from .clips import Box, Point, TrueHand, TruePerson, Truth
from .recording import Recording

FACE_MARGIN = 0.15
NEAR_FACE_WIDTHS = 0.5
FAR_FACE_WIDTHS = 1.0
MIN_FACE_PX = 100
MIN_HAND_PX = 50

DEFINITION = (
    f"face found: a face track's centroid inside the visible face's box grown by {FACE_MARGIN:.0%}, or within "
    f"{NEAR_FACE_WIDTHS:g} face widths of the visible face's centroid (faces with {MIN_FACE_PX} visible pixels or more). "
    f"Hand found: a track of that hand's kind with its centroid within {NEAR_FACE_WIDTHS:g} face widths of the visible hand's "
    f"centroid (hands with {MIN_HAND_PX} visible pixels or more); raised hands are those of the gesturing arm during a stroke. "
    f"False hand: a hand track farther than {FAR_FACE_WIDTHS:g} face width from every hand in the picture."
)


def finds_face(track: Track, person: TruePerson, truth: Truth) -> bool:
    """Whether a face track lies on the person's face."""
    face = person.face
    if track.kind != "face" or face.bbox_visible is None:
        return False
    if _inside(track.centroid_px, face.bbox_visible, FACE_MARGIN):
        return True
    limit = NEAR_FACE_WIDTHS * truth.face_width_px(person)
    return face.centroid_visible_px is not None and math.dist(track.centroid_px, face.centroid_visible_px) <= limit


def finds_hand(track: Track, hand: TrueHand, kind: str, face_width_px: float) -> bool:
    """Whether a track of this kind lies on the hand."""
    if track.kind != kind or hand.centroid_visible_px is None:
        return False
    return math.dist(track.centroid_px, hand.centroid_visible_px) <= NEAR_FACE_WIDTHS * face_width_px


def is_false_hand(track: Track, persons: list[TruePerson], truth: Truth) -> bool:
    """Whether a hand track lies on nobody's hand, left or right."""
    if track.kind not in ("left_hand", "right_hand"):
        return False
    for person in persons:
        limit = FAR_FACE_WIDTHS * truth.face_width_px(person)
        for _, hand in person.hands.sides():
            if math.dist(track.centroid_px, hand.centroid_visible_px or hand.center_px) <= limit:
                return False
    return True


def true_persons(truth: Truth, recording: Recording) -> dict[int, int]:
    """The true person behind each tracked `person_id`: whose face its face tracks lay on in most frames.

    A tracked person whose face never lay on a true one is left out.
    """
    votes: dict[int, Counter[int]] = {}
    for frame in truth.frames:
        for track in recording.tracks_at(frame.frame):
            for person in frame.persons:
                if track.person_id is not None and finds_face(track, person, truth):
                    votes.setdefault(track.person_id, Counter())[person.id] += 1
    return {tracked: min(count, key=lambda true: (-count[true], true)) for tracked, count in votes.items()}


def _inside(point: Point, box: Box, margin: float) -> bool:
    x, y, width, height = box
    return (
        x - margin * width <= point[0] <= x + (1 + margin) * width
        and y - margin * height <= point[1] <= y + (1 + margin) * height
    )
