"""How a camera sits on its robot: directions in its optical frame (REP-105) turned into `base_link` (REP-103)."""

from __future__ import annotations

import math

from deixis_schemas.messages import CameraMount

Vector = tuple[float, float, float]


def to_base(optical: Vector, mount: CameraMount) -> Vector:
    """A direction (x right, y down, z forward) as x forward, y left, z up: by the mount's roll, then pitch, then yaw."""
    roll, pitch, yaw = (math.radians(angle) for angle in (mount.roll_deg, mount.pitch_up_deg, mount.yaw_deg))
    right = optical[0] * math.cos(roll) - optical[1] * math.sin(roll)
    down = optical[0] * math.sin(roll) + optical[1] * math.cos(roll)
    forward, left, up = optical[2], -right, -down
    ahead = forward * math.cos(pitch) - up * math.sin(pitch)
    z = forward * math.sin(pitch) + up * math.cos(pitch)
    return ahead * math.cos(yaw) - left * math.sin(yaw), ahead * math.sin(yaw) + left * math.cos(yaw), z
