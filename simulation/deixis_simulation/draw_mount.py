"""How the camera is mounted: height, tilt and roll."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .dice import Dice, Range
from .framing import ANY_FRAME, Frame, Sight, pitch_to
from .scene import Camera

PITCH_LIMIT_DEG = 30.0


@dataclass(frozen=True)
class Mounts:
    """Cameras on robots. looks_above_m: what stands in the picture's middle where the first person is, so much above the lens,
    from and to; none: the middle of what has to be in the picture. tilt_deg (off that), level_deg: standard deviation and
    limit; aslant: share of those that are mounted badly. frame: what people have to fit.
    """

    height_m: Range = (0.6, 1.7)
    looks_above_m: Range | None = None
    tilt_deg: Range = (4, 12)
    level_deg: Range = (1.2, 4)
    aslant: float = 0.18
    frame: Frame = ANY_FRAME


ANY_MOUNTS = Mounts()


def draw_mount(
    dice: Dice, mounts: Mounts, fov_deg: float, height_m: float, away_m: float, sights: Sequence[Sight]
) -> Camera | None:
    """The camera, of the usual size; none where it would be tilted too far. away_m: to the first person."""
    position = (0.0, 0.0, height_m)
    tilt = dice.near(0, *_about_zero(mounts.tilt_deg), 2)
    level, aslant = dice.near(0, *_about_zero(mounts.level_deg), 2), dice.between(-9, 9, 2)
    roll = aslant if dice.chance(mounts.aslant) else level
    if mounts.looks_above_m is not None:
        middle = math.degrees(math.atan2(dice.between(*mounts.looks_above_m), away_m))
    else:
        middle = pitch_to(sights, position) if sights else 0.0
    pitch = middle + tilt
    if abs(pitch) > PITCH_LIMIT_DEG:
        return None
    return Camera(horizontal_fov_deg=fov_deg, position_m=position, pitch_up_deg=round(pitch, 2), roll_deg=roll)


def _about_zero(spread: Range) -> tuple[float, float, float]:
    sigma, limit = spread
    return sigma, -limit, limit
