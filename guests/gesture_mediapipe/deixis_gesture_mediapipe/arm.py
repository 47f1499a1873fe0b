"""Where an arm points: all stretched arms from the shoulder, and which of them the camera would see there. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from deixis_runtime.lens import Lens
from deixis_runtime.mount import to_base
from deixis_schemas.messages import BEARING_STEP_DEG, CameraMount
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Point = tuple[float, float]

BEARINGS = np.arange(-180.0, 180.0, BEARING_STEP_DEG)
ELEVATIONS = np.arange(-60.0, 40.0, 5.0)
LENGTHS = np.array([3.2, 3.6, 3.9, 4.2, 4.5])
"""From shoulder to fingertip, face widths: .52 to .74 m, arms somewhat bent and stretched."""
LENGTH_WEIGHTS = np.array([0.15, 0.3, 0.6, 1.0, 0.6])
SHOULDER_ASIDE, SHOULDER_BELOW = 1.1, 1.6
"""Of a shoulder from the middle of the face, face widths."""
SHOULDERS_TURN = 0.25
"""Who points far to a side turns the shoulders: by so much of the bearing."""
LEVEL_DEG, LEVEL_SIGMA_DEG = -8.0, 18.0
"""How high people point at what is in a room."""
TIP_SIGMA = 0.25
FINGER_SIGMA_DEG, FINGER_OUTLIERS = 35.0, 0.35
"""How far off a finger's direction is, read from a hand some twenty pixels wide; and how often it says nothing at all."""
FLOOR = 0.01
LEAST_SIGMA_DEG = 8.0


@dataclass(frozen=True)
class ArmSeen:
    """What is seen of a pointing arm, pixels. face: middle, and width; tip: of the index finger, or the middle of the hand;
    is_left: the person's own; finger_deg: where the finger points, from the direction to the camera; reach: what is left of
    an arm's length where `tip` is no fingertip, face widths less.
    """

    face: Point
    width: float
    tip: Point
    is_left: bool
    finger_deg: float | None
    short: float = 0.0


@dataclass(frozen=True)
class Bearing:
    """Direction pointed to, degrees at the person, positive toward image right; `likelihood` of BEARINGS, its largest 1."""

    deg: float
    sigma_deg: float
    mirrored: bool
    likelihood: tuple[float, ...]
    elevation_deg: float
    elevation_sigma_deg: float


def bearing_of(seen: ArmSeen, lens: Lens, size: tuple[int, int], mount: CameraMount) -> Bearing:
    """Where an arm points that is seen so through `lens` in a picture of that size (width, height)."""
    head, tip = (_level(lens, pixel, size, mount) for pixel in (seen.face, seen.tip))
    floor = math.hypot(head[0], head[1])
    away = lens.pinhole_at(seen.face, size).focal_px / seen.width
    distance, height = away, away * head[2] / max(floor, 1e-6)
    aside, slope = _beside(head, tip)
    right, up, ahead = _arms(seen.is_left, seen.short)
    left = np.maximum(distance - ahead, 0.3 * distance)
    off_x = (right / left - aside) * left
    off_y = ((height + up) / np.hypot(left, right) - slope) * left
    fits = np.exp(-0.5 * (off_x**2 + off_y**2) / TIP_SIGMA**2) * _weights()
    if seen.finger_deg is not None:
        apart = (BEARINGS - _at_person(seen.finger_deg, lens, seen, size) + 180) % 360 - 180
        finger = (1 - FINGER_OUTLIERS) * np.exp(-0.5 * (apart / FINGER_SIGMA_DEG) ** 2) + FINGER_OUTLIERS
        fits = fits * finger[:, None, None]
    by_bearing = fits.sum(axis=(1, 2))
    most = float(by_bearing.max())
    by_bearing = by_bearing / most if most > 1e-9 else np.ones(len(BEARINGS))
    likelihood = (1 - FLOOR) * by_bearing + FLOOR
    return _described(likelihood, fits.sum(axis=(0, 2)))


def _described(likelihood: Floats, by_elevation: Floats) -> Bearing:
    """The normal distribution, plain or folded at 90 degrees, that loses less of the likelihood."""
    mean, sigma = _moments(BEARINGS, likelihood)
    folded = np.where(np.abs(BEARINGS) > 90, np.sign(BEARINGS) * 180 - BEARINGS, BEARINGS)
    folded_mean, folded_sigma = _moments(folded, likelihood)
    mirrored = 2 * folded_sigma < sigma
    if mirrored:
        mean, sigma = folded_mean, folded_sigma
    total = float(by_elevation.sum())
    weights = by_elevation if total > 1e-9 else np.ones(len(ELEVATIONS))
    elevation = float(np.average(ELEVATIONS, weights=weights))
    spread = math.sqrt(float(np.average((ELEVATIONS - elevation) ** 2, weights=weights)))
    told = tuple(round(float(value), 4) for value in likelihood)
    return Bearing(mean, max(LEAST_SIGMA_DEG, sigma), mirrored, told, elevation, max(LEAST_SIGMA_DEG, spread))


def _moments(values: Floats, weights: Floats) -> tuple[float, float]:
    """Mean and standard deviation of angles, degrees, on the circle about their mean."""
    weights, radians = weights / weights.sum(), np.radians(values)
    mean = math.degrees(math.atan2(float(weights @ np.sin(radians)), float(weights @ np.cos(radians))))
    off = (values - mean + 180) % 360 - 180
    return mean, math.sqrt(float(weights @ off**2))


def _at_person(finger_deg: float, lens: Lens, seen: ArmSeen, size: tuple[int, int]) -> float:
    """A direction from the optical axis as one from the line to the camera: the camera sees the person aside of its axis."""
    return finger_deg + math.degrees(math.atan(lens.ray(seen.face, size)[0]))


def _level(lens: Lens, pixel: Point, size: tuple[int, int], mount: CameraMount) -> tuple[float, float, float]:
    """Direction of a pixel: forward, left, up."""
    x, y = lens.ray(pixel, size)
    return to_base((x, y, 1.0), mount)


def _beside(head: tuple[float, float, float], tip: tuple[float, float, float]) -> Point:
    """Of a tip: tangent of the angle to the head seen from above, positive toward image right; rise by length on the floor."""
    floor = math.hypot(head[0], head[1])
    ahead = head[0] / floor, head[1] / floor
    right = ahead[1] * tip[0] - ahead[0] * tip[1]
    forward = max(ahead[0] * tip[0] + ahead[1] * tip[1], 1e-3)
    return right / forward, tip[2] / math.hypot(right, forward)


@cache
def _arms(is_left: bool, short: float) -> tuple[Floats, Floats, Floats]:
    """Tips (bearings, elevations, lengths) of arms from the middle of the face, face widths: right, up, toward the camera."""
    bearing = np.radians(BEARINGS)[:, None, None]
    elevation, length = np.radians(ELEVATIONS)[None, :, None], (LENGTHS - short)[None, None, :]
    # The person's own left shoulder is the one at image right; both turn with the pointing.
    turn = SHOULDERS_TURN * np.where(np.abs(bearing) > math.pi / 2, np.sign(bearing) * math.pi - bearing, bearing)
    aside = SHOULDER_ASIDE if is_left else -SHOULDER_ASIDE
    floor = length * np.cos(elevation)
    right = aside * np.cos(turn) + floor * np.sin(bearing)
    ahead = -aside * np.sin(turn) + floor * np.cos(bearing)
    up = -SHOULDER_BELOW + length * np.sin(elevation) + 0 * bearing
    return right, np.broadcast_to(up, right.shape), ahead


@cache
def _weights() -> Floats:
    level = np.exp(-0.5 * ((ELEVATIONS - LEVEL_DEG) / LEVEL_SIGMA_DEG) ** 2)
    return np.asarray(level[None, :, None] * LENGTH_WEIGHTS[None, None, :])
