"""The exhibits that stand at the POIs."""

from __future__ import annotations

import math

import numpy as np

from . import textures
from .furniture import VASE, hung
from .geometry import Floats, to_world
from .scene import ScenePoi
from .shapes import box, lathe, sphere
from .surface import Surface, linear_tint

Rng = np.random.Generator

PLINTH_M = 0.32
BELOW_POI_M = 0.16
"""An exhibit is about twice this high; the POI is its middle."""
CUP = [(0.14, 0), (0.12, 0.02), (0.03, 0.05), (0.03, 0.12), (0.1, 0.2), (0.15, 0.3), (0.14, 0.3)]
BUST = [
    (0.10, 0),
    (0.09, 0.03),
    (0.13, 0.07),
    (0.15, 0.11),
    (0.06, 0.15),
    (0.055, 0.18),
    (0.09, 0.22),
    (0.1, 0.27),
    (0.06, 0.33),
    (0.001, 0.34),
]


def build_exhibit(poi: ScenePoi, number: int, rng: Rng) -> list[Surface]:
    """The exhibit on its plinth, world; `number` turns the plinth, so that not all stand alike."""
    x, y, z = poi.position_m
    foot = max(z - BELOW_POI_M, 0.0)
    base, top = to_world((x, y, 0.0)), to_world((x, y, foot))
    tint = linear_tint(poi.tone)
    if poi.exhibit == "picture":
        return _easel(base, z, textures.painting(rng))
    made = {
        "vase": Surface(lathe(top, VASE), None, tint, 0.25, 1.2),
        "sphere": Surface(sphere(top + np.array((0, 0.15, 0)), 0.14), None, tint, 0.35, 0.8),
        "cube": Surface(box(top + np.array((0, 0.13, 0)), (0.2, 0.26, 0.2), 35), None, tint, 0.5, 0.3),
        "cup": Surface(lathe(top, CUP), None, tint, 0.2, 1.5),
        "bust": Surface(lathe(top, BUST), None, tint, 0.7, 0.2),
    }[poi.exhibit or "cube"]
    if foot < 0.05:
        return [made]
    plinth = box(base + np.array((0, foot / 2, 0)), (PLINTH_M, foot, PLINTH_M), 20 * number)
    return [Surface(plinth, None, (0.72, 0.71, 0.69), 0.6, 0.15), made]


def _easel(base: Floats, height: float, picture: textures.Picture) -> list[Surface]:
    turn = math.degrees(math.atan2(-base[0], -base[2] if base[2] else 1e-6))
    framed = hung(picture, 0.48, 0.36, height - 0.18)
    legs = [Surface(box((x, height / 2 + 0.1, -0.05), (0.03, height + 0.2, 0.03)), tint=(0.25, 0.17, 0.1)) for x in (-0.2, 0.2)]
    return [surface.placed(base, turn) for surface in (*legs, *framed)]
