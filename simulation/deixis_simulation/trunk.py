"""How much of a turn the trunk does, and how head and eyes share the rest. Degrees, from straight ahead, left positive."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .geometry import Floats, wrap_deg
from .rotations import azimuth_deg
from .skeleton import Posture

NECK_DEG = 75.0
"""Farthest turn of the head from the chest."""
TRUNK_DEG = 115.0
EYES_DEG = 35.0


def usual_trunk_deg(azimuth: float) -> float:
    """Turn of the trunk when someone looks or points there: little to 60 degrees, most of what lies beyond."""
    size = abs(azimuth)
    return math.copysign(0.22 * size if size < 60 else 13.2 + 0.72 * (size - 60), azimuth)


def enough_trunk_deg(trunk_deg: float, head_deg: float) -> float:
    """The turn of the trunk, more if the neck could not reach `head_deg` otherwise."""
    least, most = head_deg - NECK_DEG, head_deg + NECK_DEG
    return min(max(min(max(trunk_deg, least), most), -TRUNK_DEG), TRUNK_DEG)


def reachable_deg(head_deg: float, trunk_deg: float) -> float:
    """The head's azimuth nearest to `head_deg` that the neck reaches from a chest that looks at `trunk_deg`."""
    return trunk_deg + _clip(wrap_deg(head_deg - trunk_deg), NECK_DEG)


@dataclass(frozen=True)
class Look:
    """Where head and eyes go: head yaw, pitch up, roll; eyes in the head yaw, pitch up."""

    head: tuple[float, float, float]
    gaze: tuple[float, float]

    def mix_into(self, posture: Posture, share: float, eyes_ahead: float = 0.0) -> None:
        """Bring a posture's head there by a share; half of its small movements stay. `eyes_ahead`: the eyes' lead, a share."""
        rest = 1 - 0.5 * share
        yaw, pitch, roll = posture.head
        start = yaw
        posture.head = (
            yaw + (self.head[0] - yaw) * share,
            pitch * rest + self.head[1] * share,
            roll * rest + self.head[2] * share,
        )
        lead = (self.head[0] - start) * eyes_ahead
        posture.gaze = (
            _clip(posture.gaze[0] * rest + self.gaze[0] * share + lead, EYES_DEG),
            _clip(posture.gaze[1] * rest + self.gaze[1] * share, EYES_DEG),
        )


def azimuth_of(direction: Floats, favoured_sign: float = 0.0) -> float:
    """Azimuth of a direction; what lies behind is taken over the favoured side (sign), to 210 degrees."""
    bias = 30.0 * favoured_sign
    return wrap_deg(azimuth_deg(direction) - bias) + bias


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
