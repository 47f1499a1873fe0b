"""What the picture is taken with: size, lens, sensor, compression."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .dice import Dice, Range
from .scene import Sensor

Size = tuple[int, int]
SIZES: dict[Size, float] = {(320, 240): 0.2, (640, 480): 0.45, (960, 540): 0.2, (1280, 720): 0.15}
"""Sizes of the picture that are drawn, by weight."""


@dataclass(frozen=True)
class Optics:
    """Lenses and sensors, each range from and to. per_shutter_s: shutters a second; cast, green: the error of the white
    balance, standard deviation and limit.
    """

    sizes: Mapping[Size, float] = field(default_factory=lambda: SIZES)
    fov_deg: Range = (50.0, 90.0)
    exposure: Range = (0.65, 1.45)
    per_shutter_s: Range = (25, 200)
    noise: Range = (0.4, 3.5)
    blur_px: Range = (0.4, 1.4)
    sharpening: Range = (0.0, 0.9)
    saturation: Range = (0.75, 1.25)
    contrast: Range = (-0.1, 0.25)
    cast: Range = (0.06, 0.16)
    green: Range = (0.02, 0.05)
    quality_crf: Range = (16, 32)


ANY_OPTICS = Optics()


@dataclass(frozen=True)
class Overrides:
    """What a caller fixes; none: drawn. `fov_deg`: from, to."""

    size: Size | None = None
    fov_deg: Range | None = None


def draw_size(dice: Dice, overrides: Overrides, optics: Optics = ANY_OPTICS) -> Size:
    """Width and height. Drawn first and overridden after: what follows is the same either way."""
    drawn = dice.weighed(optics.sizes)
    return overrides.size or drawn


def draw_fov(dice: Dice, overrides: Overrides, optics: Optics = ANY_OPTICS) -> float:
    """Horizontal field of view, degrees: the same share of whatever range is asked for."""
    low, high = overrides.fov_deg or optics.fov_deg
    return dice.between(low, high, 2)


def draw_sensor(dice: Dice, optics: Optics = ANY_OPTICS) -> Sensor:
    """Lens, sensor and processing of one camera."""
    (cast_sigma, cast_limit), (green_sigma, green_limit) = optics.cast, optics.green
    cast = dice.near(0, cast_sigma, -cast_limit, cast_limit)
    return Sensor(
        exposure=dice.between_log(*optics.exposure),
        shutter_s=round(1 / dice.between_log(*optics.per_shutter_s), 5),
        noise=dice.between_log(*optics.noise),
        blur_px=dice.between_log(*optics.blur_px),
        sharpening=dice.between(*optics.sharpening),
        saturation=dice.between(*optics.saturation),
        contrast=dice.between(*optics.contrast),
        white_balance=(
            round(1 + cast, 3),
            dice.near(1, green_sigma, 1 - green_limit, 1 + green_limit),
            round(1 - cast, 3),
        ),
        quality_crf=dice.between(*optics.quality_crf, 1),
    )
