"""Where a stage answers otherwise than it did, and how far it may."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from deixis_schemas.messages import Message

from .statements import Stated, Value, statements


def _equal(old: Value, new: Value) -> float:
    return float(old != new)


def _apart(old: Value, new: Value) -> float:
    return math.dist(_numbers(old), _numbers(new))


def _angle(old: Value, new: Value) -> float:
    return max(abs((b - a + 180) % 360 - 180) for a, b in zip(_numbers(old), _numbers(new), strict=True))


def _relative(old: Value, new: Value) -> float:
    return max(abs(b - a) / max(abs(a), 1e-9) for a, b in zip(_numbers(old), _numbers(new), strict=True))


def _numbers(value: Value) -> tuple[float, ...]:
    if isinstance(value, str):
        raise TypeError(f"'{value}' is compared as a number")
    return value if isinstance(value, tuple) else (value,)


@dataclass(frozen=True)
class Tolerance:
    """How far one field of a stage may be from its reference: by `limit`, and by more in a `share` of the frames."""

    stage: str
    field: str
    measure: Callable[[Value, Value], float]
    limit: float
    share: float


TOLERANCES = (
    Tolerance("tracker", "frames", _equal, 0, 0),
    Tolerance("tracker", "tracks", _equal, 0, 0.02),
    Tolerance("tracker", "centre_px", _apart, 2.0, 0.02),
    Tolerance("tracker", "size_px", _relative, 0.05, 0.02),
    Tolerance("tracker", "contour_area_px", _relative, 0.10, 0.02),
    Tolerance("tracker", "frontal", _equal, 0, 0.05),
    Tolerance("tracker", "frontal_centre_px", _apart, 2.0, 0.02),
    Tolerance("tracker", "frontal_width_px", _relative, 0.05, 0.02),
    Tolerance("headpose", "frames", _equal, 0, 0),
    Tolerance("headpose", "persons", _equal, 0, 0.02),
    Tolerance("headpose", "status", _equal, 0, 0.02),
    Tolerance("headpose", "side", _equal, 0, 0.02),
    Tolerance("headpose", "yaw_deg", _angle, 1.5, 0.02),
    Tolerance("headpose", "yaw_sigma_deg", _relative, 0.15, 0.02),
    Tolerance("headpose", "pitch_deg", _angle, 1.5, 0.02),
    Tolerance("headpose", "roll_deg", _angle, 1.5, 0.02),
    Tolerance("headpose", "pitch_sigma_deg", _relative, 0.15, 0.02),
    Tolerance("headpose", "roll_sigma_deg", _relative, 0.15, 0.02),
    Tolerance("gesture", "frames", _equal, 0, 0),
    Tolerance("gesture", "persons", _equal, 0, 0.02),
    Tolerance("gesture", "phase", _equal, 0, 0.03),
    Tolerance("gesture", "gesture", _equal, 0, 0.03),
    Tolerance("gesture", "hand", _equal, 0, 0.03),
    Tolerance("gesture", "bearing_deg", _angle, 3.0, 0.03),
    Tolerance("gesture", "bearing_sigma_deg", _relative, 0.15, 0.03),
    Tolerance("fusion", "frames", _equal, 0, 0),
    Tolerance("fusion", "persons", _equal, 0, 0.02),
    Tolerance("fusion", "pointing", _equal, 0, 0.03),
    Tolerance("fusion", "distance_m", _relative, 0.02, 0.02),
    Tolerance("fusion", "unknown", _apart, 0.03, 0.03),
    Tolerance("fusion", "conflict", _apart, 0.03, 0.03),
    Tolerance("fusion", "pignistic", _apart, 0.03, 0.03),
    Tolerance("fusion", "probability", _apart, 0.03, 0.03),
    Tolerance("fusion", "evidence_weight", _apart, 0.03, 0.03),
    Tolerance("fusion", "answers", _equal, 0, 0),
    Tolerance("fusion", "answer_from_to_s", _apart, 0.15, 0),
)
"""All of them. `share` leaves room for the frames around a change of state, which may come a frame or two sooner or later."""


@dataclass(frozen=True)
class Difference:
    """A field that is beyond its tolerance in more frames than it may be. old, new: in `first`, the first frame of them."""

    tolerance: Tolerance
    frames: int
    of_frames: int
    first: int
    subject: str
    old: Value | None
    new: Value | None

    def __str__(self) -> str:
        tolerance = self.tolerance
        beyond = f" by more than {tolerance.limit:g}" if tolerance.limit else ""
        allowed = math.floor(tolerance.share * self.of_frames)
        return (
            f"{tolerance.stage}: {tolerance.field} differs{beyond} in {self.frames} of {self.of_frames} frames "
            f"({allowed} allowed), first in frame {self.first}: {self.subject} was {_say(self.old)}, is {_say(self.new)}"
        )


@dataclass
class _Count:
    frames: set[int] = field(default_factory=set)
    first: tuple[int, str, Value | None, Value | None] | None = None

    def add(self, frame: int, subject: str, old: Value | None, new: Value | None) -> None:
        self.frames.add(frame)
        self.first = self.first or (frame, subject, old, new)


def differences(stage: str, old: Sequence[Message], new: Sequence[Message]) -> list[Difference]:
    """Compare what a stage answered to a clip with what it used to. Empty where all is within tolerance."""
    before, after = statements(old), statements(new)
    frames = sorted({*before, *after})
    found = []
    for tolerance in TOLERANCES:
        if tolerance.stage == stage:
            count = _count(tolerance, before, after, frames)
            if count.first is not None and len(count.frames) > math.floor(tolerance.share * len(frames)):
                found.append(Difference(tolerance, len(count.frames), len(frames), *count.first))
    return found


def _count(tolerance: Tolerance, before: dict[int, Stated], after: dict[int, Stated], frames: Sequence[int]) -> _Count:
    """The frames in which a field is beyond its tolerance. Subjects that only one side has are another field's business."""
    count = _Count()
    for frame in frames:
        if tolerance.field == "frames":
            if (frame in before) != (frame in after):
                count.add(frame, "the frame", *("answered" if frame in side else "not answered" for side in (before, after)))
            continue
        old, new = (side.get(frame, {}).get(tolerance.field, {}) for side in (before, after))
        for subject in sorted(old.keys() & new.keys()):
            if tolerance.measure(old[subject], new[subject]) > tolerance.limit:
                count.add(frame, subject, old[subject], new[subject])
    return count


def _say(value: Value | None) -> str:
    if isinstance(value, tuple):
        return "(" + ", ".join(f"{number:.1f}" for number in value) + ")"
    return f"{value:.3g}" if isinstance(value, float) else f"'{value}'"
