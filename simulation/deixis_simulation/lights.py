"""Lamps and windows of a scene, and how bright it is over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .geometry import Floats
from .scene import Light, Scene

MAX_LAMPS = 16
FILLS = 4
EXPOSURE_RATE_HZ = 3.0
"""How fast the automatic exposure follows: share of the error taken back per second."""
EXPOSURE_LIMITS = (0.4, 4.0)


@dataclass(frozen=True)
class Lamp:
    """A sample of an area light. Falls off by `reach2_m2` over distance squared where it is a key light, else not at all.

    softness: radius of its shadow's blur, as a share of the shadow map.
    """

    position: Floats
    colour: Floats
    softness: float
    reach2_m2: float = 0.0
    key: bool = False


@dataclass(frozen=True)
class Lighting:
    """All lamps, key lights first, and what comes from everywhere: from above and from below."""

    lamps: tuple[Lamp, ...]
    ambient_up: Floats
    ambient_down: Floats


def lighting(light: Light, centre: Sequence[float] | Floats) -> Lighting:
    """The lamps of a preset around `centre` (world; where people stand)."""
    made = _PRESETS[light.preset](float(centre[0]), float(centre[2]))
    tint = np.array(light.tint)
    lamps = sorted((replace(lamp, colour=lamp.colour * tint) for lamp in made.lamps), key=lambda lamp: not lamp.key)
    return Lighting(tuple(lamps[:MAX_LAMPS]), made.ambient_up * tint, made.ambient_down * tint)


def light_gain_at(light: Light, time_s: float) -> float:
    """Brightness of the lamps at a time, 1: as usual."""
    gain = 1.0
    for change in sorted(light.changes, key=lambda item: item.at_s):
        if time_s < change.at_s:
            break
        share = 1.0 if change.over_s == 0 else min(1.0, (time_s - change.at_s) / change.over_s)
        gain += share * (change.gain - gain)
    flicker = 1 - light.flicker_depth * 0.5 * (1 - math.cos(2 * math.pi * light.flicker_hz * time_s))
    return gain * flicker


def picture_gains(scene: Scene) -> list[float]:
    """Brightness of each frame: the lamps' gain, and the automatic exposure that follows it."""
    gains, exposure = [], 1.0
    for frame in range(scene.frames):
        lamp = light_gain_at(scene.light, frame / scene.fps)
        gains.append(lamp * exposure)
        if scene.light.auto_exposure:
            step = 1 - math.exp(-EXPOSURE_RATE_HZ / scene.fps)
            wanted = exposure / max(lamp * exposure, 0.02)
            exposure = min(max(exposure + step * (wanted - exposure), EXPOSURE_LIMITS[0]), EXPOSURE_LIMITS[1])
    return gains


def _lamp(position: Sequence[float], colour: Sequence[float], strength: float, softness: float, reach2_m2: float) -> Lamp:
    return Lamp(np.array(position, float), np.array(colour, float) * strength, softness, reach2_m2, key=True)


def _fills(x: float, z: float, colour: Sequence[float], strength: float) -> list[Lamp]:
    """A ring of weak lamps, as light that comes back from the walls."""
    lamps = []
    for number in range(FILLS):
        angle = 2 * math.pi * (number + 0.37) / FILLS
        place = np.array([x + 4 * math.cos(angle), (1.3, 2.6)[number % 2], z + 4 * math.sin(angle)])
        lamps.append(Lamp(place, np.array(colour, float) * strength / FILLS, 0.06))
    return lamps


def _office(x: float, z: float) -> Lighting:
    places = [(x + dx, 2.72, z + dz) for dz in (1.7, 0.1) for dx in (-1.1, 1.1)]
    keys = [_lamp(place, (1.0, 0.98, 0.93), 0.7, 0.035, 3.0) for place in places]
    return _of(keys + _fills(x, z, (0.97, 1, 1.03), 0.75), (0.15, 0.15, 0.155), (0.10, 0.09, 0.08))


def _window(x: float, z: float, side: int) -> Lighting:
    keys = [_lamp((x + 2.9 * side, y, z + dz), (0.92, 1.0, 1.12), 0.9, 0.03, 8.0) for y in (1.2, 1.9) for dz in (0.8, 2.2)]
    keys.append(_lamp((x, 2.7, z + 1.0), (1.0, 0.86, 0.66), 0.35, 0.05, 3.0))
    return _of(keys + _fills(x, z, (1, 0.97, 0.94), 0.55), (0.13, 0.13, 0.14), (0.10, 0.09, 0.08))


def _warm(x: float, z: float) -> Lighting:
    spots = ((-1.5, 2.0), (1.4, 1.7), (0.4, 3.4))
    places = [(x + dx, 2.6, z + dz) for dx, dz in spots]
    keys = [_lamp(place, (1.0, 0.86, 0.66), 1.2, 0.05, 5.2) for place in places]
    return _of(keys + _fills(x, z, (1, 0.86, 0.66), 0.7), (0.14, 0.12, 0.09), (0.10, 0.08, 0.055))


def _hard(x: float, z: float) -> Lighting:
    places = [(x - 1.3 + dx, 2.5 + dy, z + 2.2) for dx, dy in ((0, 0), (0.08, 0.05), (-0.08, -0.03))]
    keys = [_lamp(place, (1.0, 0.95, 0.85), 1.0, 0.02, 7.0) for place in places]
    return _of(keys + _fills(x, z, (0.95, 0.98, 1.05), 0.5), (0.10, 0.10, 0.11), (0.07, 0.065, 0.06))


def _of(lamps: list[Lamp], up: Sequence[float], down: Sequence[float]) -> Lighting:
    return Lighting(tuple(lamps), np.array(up, float), np.array(down, float))


_PRESETS = {
    "office": _office,
    "window_left": lambda x, z: _window(x, z, -1),
    "window_right": lambda x, z: _window(x, z, 1),
    "warm": _warm,
    "hard": _hard,
}
