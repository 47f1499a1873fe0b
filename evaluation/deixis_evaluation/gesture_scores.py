"""What the gesture stage said of each true pointing stroke, and when it said pointings that were none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Literal

import numpy as np
from deixis_schemas.messages import BEARING_STEP_DEG, Gesture

from .angle_scores import signed_error_deg
from .clips import SideName, Truth
from .episode_scores import Stroke, strokes_of
from .recording import Recording
from .true_elevation import elevation_of

POINTING = ("point_left", "point_right", "invisible")
LEAST_SHARE = 0.2
"""A stroke of which a pointing is said in so many of the frames is recognised."""
DIRECTED_SHARE = 0.3
"""As fusion has it: a side said in so many of these frames is what was said."""
AROUND_S = 0.5
"""What is said so long before or after a true stroke belongs to it: a hand stands a little sooner and later."""
APART_S = 0.4
"""Pointings that are said with a shorter gap are one."""
Said = Literal["point_left", "point_right", "invisible", "missed"]

DEFINITION = (
    f"recognised: a pointing (either side, or invisible) is said of the person in {LEAST_SHARE:.0%} of the stroke's frames. "
    "Side: of strokes at 30 to 150 degrees that are recognised with a side. Bearing: off by, and how often the true one is "
    "among the likeliest that hold 68 and 95 %. Elevation: off by, at the head, and how often within 1 and 1.96 sigma. "
    "Onset, end: first and last frame in a stroke, after the true one. False: "
    f"pointings said more than {AROUND_S:g} s away from every true stroke of the person; by the minute where nobody points."
)


@dataclass(frozen=True)
class StrokeScore:
    """One true stroke. azimuth_deg: of the POI; side: to which it lies, none in front and behind. bearing_off_deg: of the
    likeliest bearing, signed; level: share of the likelihood in what is likelier than the true one. onset_s, end_s: after the
    true ones. probability: median of the stated one. elevation_off_deg: signed, elevation_sigma_deg: as stated, medians. None
    where it was not said.
    """

    clip: str
    person: int
    azimuth_deg: float
    arm: SideName | None
    side: SideName | None
    frames: int
    said: Said
    bearing_off_deg: float | None = None
    level: float | None = None
    onset_s: float | None = None
    end_s: float | None = None
    probability: float | None = None
    elevation_off_deg: float | None = None
    elevation_sigma_deg: float | None = None


@dataclass(frozen=True)
class FalsePointing:
    """A pointing that was said of a tracked person and is none: first and last frame."""

    person_id: int
    first: int
    last: int


@dataclass(frozen=True)
class GestureScore:
    """One clip of `seconds`."""

    name: str
    kind: str
    seconds: float
    strokes: tuple[StrokeScore, ...] = ()
    false: tuple[FalsePointing, ...] = ()
    failure: str | None = None

    @property
    def is_quiet(self) -> bool:
        """Whether nobody points."""
        return self.failure is None and not self.strokes


def score_gestures(name: str, truth: Truth, recording: Recording, persons: Mapping[int, int]) -> GestureScore:
    """Score what was said of all frames; `persons` is the true person behind each tracked one."""
    strokes = strokes_of(truth)
    scores = tuple(_score(name, stroke, truth, recording, persons) for stroke in strokes)
    false = tuple(_false_pointings(truth, strokes, recording, persons))
    return GestureScore(name, truth.meta.kind, len(truth.frames) / truth.meta.fps, scores, false)


def _score(name: str, stroke: Stroke, truth: Truth, recording: Recording, persons: Mapping[int, int]) -> StrokeScore:
    own = {tracked for tracked, true in persons.items() if true == stroke.person_id}
    said = {
        frame: gesture
        for frame in range(stroke.first, stroke.last + 1)
        for gesture in recording.gestures_at(frame)
        if gesture.person_id in own and gesture.phase == "stroke"
    }
    pointing = [gesture for gesture in said.values() if gesture.gesture in POINTING]
    frames = stroke.last - stroke.first + 1
    fps = truth.meta.fps
    onset_s = (min(said) - stroke.first) / fps if said else None
    end_s = _end_s(stroke, truth, recording, own) if said else None
    kind = _kind(pointing) if len(pointing) >= LEAST_SHARE * frames else "missed"
    arm, azimuth = stroke.persons[0].arm.side, stroke.azimuth_deg
    if kind == "missed":
        return StrokeScore(name, stroke.person_id, azimuth, arm, stroke.side, frames, kind, onset_s=onset_s, end_s=end_s)
    off, level = _bearing(pointing, azimuth)
    told = [gesture.point_probability for gesture in pointing if gesture.point_probability is not None]
    probability = median(told) if told else None
    high = _elevation(pointing, elevation_of(stroke, truth))
    return StrokeScore(
        name, stroke.person_id, azimuth, arm, stroke.side, frames, kind, off, level, onset_s, end_s, probability, *high
    )


def _end_s(stroke: Stroke, truth: Truth, recording: Recording, own: set[int]) -> float:
    """When the hand no longer stands, after the stroke's end."""
    last = stroke.first
    for frame in range(stroke.first, min(len(truth.frames), stroke.last + 1 + round(AROUND_S * truth.meta.fps))):
        if any(gesture.person_id in own and gesture.phase == "stroke" for gesture in recording.gestures_at(frame)):
            last = frame
    return (last - stroke.last) / truth.meta.fps


def _kind(pointing: Sequence[Gesture]) -> Said:
    votes: Counter[str] = Counter(gesture.gesture for gesture in pointing)
    directed: Said = "point_left" if votes["point_left"] >= votes["point_right"] else "point_right"
    return directed if votes[directed] >= DIRECTED_SHARE * len(pointing) else "invisible"


def _bearing(pointing: Sequence[Gesture], true_deg: float) -> tuple[float | None, float | None]:
    curves = [gesture.bearing_likelihood for gesture in pointing if gesture.bearing_likelihood]
    if not curves:
        told = [gesture.bearing_deg for gesture in pointing if gesture.bearing_deg is not None]
        return (signed_error_deg(median(told), true_deg) if told else None), None
    curve = np.mean(curves, axis=0)
    bearings = np.arange(len(curve)) * BEARING_STEP_DEG - 180
    order = np.argsort(-curve)
    near = int(np.argmin([abs(signed_error_deg(float(bearing), true_deg)) for bearing in bearings]))
    likelier = order[: int(np.nonzero(order == near)[0][0])]
    level = float(curve[likelier].sum() / curve.sum())
    return signed_error_deg(float(bearings[order[0]]), true_deg), level


def _elevation(pointing: Sequence[Gesture], true_deg: float | None) -> tuple[float | None, float | None]:
    told = [gesture.elevation_deg for gesture in pointing if gesture.elevation_deg is not None]
    if not told or true_deg is None:
        return None, None
    return median(told) - true_deg, median(
        gesture.elevation_sigma_deg or 0.0 for gesture in pointing if gesture.elevation_sigma_deg
    )


def _false_pointings(
    truth: Truth, strokes: Sequence[Stroke], recording: Recording, persons: Mapping[int, int]
) -> Iterator[FalsePointing]:
    around, apart = round(AROUND_S * truth.meta.fps), round(APART_S * truth.meta.fps)
    said: dict[int, list[int]] = {}
    for frame in range(len(truth.frames)):
        for gesture in recording.gestures_at(frame):
            if gesture.phase == "stroke" and gesture.gesture in POINTING:
                said.setdefault(gesture.person_id, []).append(frame)
    for person_id, frames in sorted(said.items()):
        own = [stroke for stroke in strokes if persons.get(person_id) == stroke.person_id]
        for first, last in _runs(frames, apart):
            if not any(first <= stroke.last + around and last >= stroke.first - around for stroke in own):
                yield FalsePointing(person_id, first, last)


def _runs(frames: Sequence[int], apart: int) -> Iterator[tuple[int, int]]:
    first = before = frames[0]
    for frame in frames[1:]:
        if frame - before > apart:
            yield first, before
            first = frame
        before = frame
    yield first, before
