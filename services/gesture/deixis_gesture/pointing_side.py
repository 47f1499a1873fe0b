"""To which side a pointing hand points: by its place where it is held far out, else by its finger, else it is invisible."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from .fingertips import Finger
from .hand import HandShape
from .rules import CENTRAL, FAR_STRETCHED, FINGER_DIRECTION, POINTING_FINGER

PointingKind = Literal["point_left", "point_right", "invisible"]


def pointing_side(hand: HandShape, fingers: Sequence[Finger]) -> PointingKind:
    """Of one frame; `fingers` the longest first."""
    if abs(hand.tip[0]) >= FAR_STRETCHED:
        return _toward(hand.tip[0])
    if not fingers or fingers[0].length < POINTING_FINGER:
        return "invisible"
    x = fingers[0].tip[0] if abs(hand.palm[0]) >= CENTRAL else fingers[0].tip[0] - hand.palm[0]
    return "invisible" if abs(x) < FINGER_DIRECTION else _toward(x)


def _toward(x: float) -> PointingKind:
    return "point_left" if x > 0 else "point_right"
