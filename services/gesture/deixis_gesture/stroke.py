"""What a stroke has shown so far, frame by frame, and what gesture it is by one of two sets of rules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from deixis_schemas.messages import GestureKind

from .fingertips import Finger
from .hand import HandShape
from .held_hand import HeldHand
from .phases import Way


@dataclass(frozen=True)
class Look:
    """One frame of a stroke. hand, fingers: in the picture's directions; held: the same hand mirrored to a left one. way: how
    it came up, none where that was not seen. may_be_invisible: its history allows a pointing without a visible finger;
    joined: the other hand is held up beside it.
    """

    time_s: float
    hand: HandShape
    fingers: tuple[Finger, ...]
    held: HeldHand
    way: Way | None
    may_be_invisible: bool
    joined: bool


@dataclass(frozen=True)
class Verdict:
    """gesture: `none` before it is decided. probability: that the stroke points; measures: what was weighed for it, and
    log_odds: what each of them spoke for it or against it, by name. None and empty where the rules do not weigh.
    """

    gesture: GestureKind = "none"
    probability: float | None = None
    measures: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    log_odds: Mapping[str, float] = field(default_factory=dict)


class StrokeRules(Protocol):
    """Follows one stroke."""

    def add(self, look: Look) -> Verdict:
        """Take one more frame; times must rise."""
        ...
