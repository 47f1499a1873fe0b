"""What the picture is taken with: size, lens, sensor, compression."""

from __future__ import annotations

from dataclasses import dataclass

from .dice import Dice
from .scene import Sensor

Size = tuple[int, int]
SIZES: dict[Size, float] = {(320, 240): 0.2, (640, 480): 0.45, (960, 540): 0.2, (1280, 720): 0.15}
"""Sizes of the picture that are drawn, by weight."""
FOV_DEG = (50.0, 90.0)


@dataclass(frozen=True)
class Overrides:
    """What a caller fixes; none: drawn. `fov_deg`: from, to."""

    size: Size | None = None
    fov_deg: tuple[float, float] | None = None


def draw_size(dice: Dice, overrides: Overrides) -> Size:
    """Width and height. Drawn first and overridden after: what follows is the same either way."""
    drawn = dice.weighed(SIZES)
    return overrides.size or drawn


def draw_fov(dice: Dice, overrides: Overrides) -> float:
    """Horizontal field of view, degrees: the same share of whatever range is asked for."""
    low, high = overrides.fov_deg or FOV_DEG
    return dice.between(low, high, 2)


def draw_sensor(dice: Dice) -> Sensor:
    """Lens, sensor and processing of one camera."""
    cast = dice.near(0, 0.06, -0.16, 0.16)
    return Sensor(
        exposure=dice.between_log(0.65, 1.45),
        shutter_s=round(1 / dice.between_log(25, 200), 5),
        noise=dice.between_log(0.4, 3.5),
        blur_px=dice.between_log(0.4, 1.4),
        sharpening=dice.between(0.0, 0.9),
        saturation=dice.between(0.75, 1.25),
        contrast=dice.between(-0.1, 0.25),
        white_balance=(round(1 + cast, 3), dice.near(1, 0.02, 0.95, 1.05), round(1 - cast, 3)),
        quality_crf=dice.between(16, 32, 1),
    )
