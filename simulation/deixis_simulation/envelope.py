"""When a gesture begins, stands and ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .geometry import smooth_step
from .scene import HeadTurn, Pointing, Quiet

Phase = Literal["none", "preparation", "stroke", "retraction"]


@dataclass(frozen=True)
class Envelope:
    """Preparation, stroke, retraction: seconds."""

    start_s: float
    preparation_s: float
    hold_s: float
    retraction_s: float

    @property
    def middle_s(self) -> float:
        """Middle of the stroke."""
        return self.start_s + self.preparation_s + self.hold_s / 2

    def phase(self, time_s: float) -> Phase:
        """The phase at a time."""
        since = time_s - self.start_s
        if since < 0:
            return "none"
        if since < self.preparation_s:
            return "preparation"
        if since <= self.preparation_s + self.hold_s:
            return "stroke"
        return "retraction" if since <= self.preparation_s + self.hold_s + self.retraction_s else "none"

    def share(self, time_s: float, lag_s: float = 0.0, release_lag_s: float | None = None) -> float:
        """How far the gesture is done, 0 to 1, with minimum jerk; of a limb that comes `lag_s` after, and leaves so."""
        since = time_s - self.start_s - lag_s
        release = time_s - self.start_s - (lag_s if release_lag_s is None else release_lag_s)
        back = (release - self.preparation_s - self.hold_s) / self.retraction_s
        return smooth_step(since / self.preparation_s) * (1 - smooth_step(back))


def envelope_of(action: Pointing | Quiet | HeadTurn) -> Envelope:
    """The times of an action."""
    if isinstance(action, HeadTurn):
        return Envelope(action.start_s, action.turn_s, action.hold_s, action.turn_s)
    return Envelope(action.start_s, action.preparation_s, action.hold_s, action.retraction_s)


def shape_share(share: float, phase: Phase) -> float:
    """How far the hand's shape is done: it forms late in the preparation, and stays while the arm falls."""
    raw = share * 1.35 - 0.12 if phase != "retraction" else share * 1.25 - 0.1
    return min(max(raw, 0.0), 1.0)
