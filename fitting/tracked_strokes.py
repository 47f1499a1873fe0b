"""Strokes of clips as tracker and gesture stage see them, with what their hands truly do."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from deixis_evaluation.clips import Clip, TruePerson, Truth
from deixis_evaluation.replay import Given, replay_tracker
from deixis_gesture.config import GestureConfig
from deixis_gesture.pointing_odds import Measures
from deixis_gesture.recognizer import GestureRecognizer
from deixis_runtime.lens import Lens
from deixis_schemas.messages import Track, Tracks

NEAR_FACE_WIDTHS = 0.7
"""A hand track nearer than this to a true hand is that hand."""
Doing = Literal["points", "moves", "else", "nobody"]


@dataclass(frozen=True)
class SeenStroke:
    """One frame of a stroke. number: of the stroke, over all clips; doing: what its hand truly does (`moves`: on its way to or
    from a pointing; `nobody`: there is no hand); gesture: the label's word for that.
    """

    clip: str
    number: int
    doing: Doing
    gesture: str
    measures: Measures


def strokes_of(clips: Sequence[Clip]) -> Iterator[SeenStroke]:
    """All frames of all strokes of these clips."""
    first = 0
    for clip in clips:
        played = list(_of_clip(Given(clip), first))
        first = max((seen.number + 1 for seen in played), default=first)
        yield from played


def _of_clip(given: Given, first: int) -> Iterator[SeenStroke]:
    clip, recognizer = given.clip, GestureRecognizer(GestureConfig())
    lens, mount = Lens.of(given.camera()), given.camera().mount
    numbers: dict[int, int] = {}
    for frame, seen in zip(clip.truth.frames, Given(clip, replay_tracker(given)).of(Tracks), strict=True):
        size, offset = (seen.width, seen.height), seen.room_offset_px
        recognizer.update(seen.tracks, *size, lens, seen.run, seen.stamp_ns, offset, mount)
        by_id = {track.track_id: track for track in seen.tracks}
        for arm in (arm for person in recognizer.persons.values() for arm in person.arms):
            if arm.track_id not in by_id or not arm.verdict.measures:
                numbers.pop(id(arm), None)
                continue
            if id(arm) not in numbers:
                numbers[id(arm)], first = first, first + 1
            doing, gesture = _doing(by_id[arm.track_id], frame.persons, clip.truth)
            yield SeenStroke(clip.name, numbers[id(arm)], doing, gesture, dict(arm.verdict.measures))


def _doing(track: Track, persons: Sequence[TruePerson], truth: Truth) -> tuple[Doing, str]:
    near = [
        (math.dist(track.centroid_px, hand.centroid_visible_px or hand.center_px) / truth.face_width_px(person), person, side)
        for person in persons
        for side, hand in person.hands.sides()
    ]
    distance, person, side = min(near, key=lambda found: found[0], default=(math.inf, None, None))
    if person is None or distance > NEAR_FACE_WIDTHS:
        return "nobody", "nobody"
    if person.gesture != "point" or person.arm.side != side:
        return "else", person.gesture
    return ("points" if person.points else "moves"), "point"
