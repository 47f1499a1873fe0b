"""Bearing of a pointing from one camera: how far beside the face the fingertip is seen.

With the arm of length R stretched toward bearing b, the tip lies R sin b beside the face and R cos b nearer to the camera,
so that it is seen D R sin b / (D - R cos b) beside the face, D being the person's distance; all in face widths. Each offset
belongs to two bearings, one in front and one behind; the size of the fist and how much of the finger is seen tell them apart
only in part. So the bearing is a posterior over a grid, and is reported as a mean with its standard deviation, or, where this
describes the posterior better, folded at 90 degrees (`mirrored`). People's arms differ: a likelihood, never an answer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M

# How far before the face a stretched arm holds its fingertip, 4.2 face widths; its spread over people and postures.
REACH = 0.689 / FACE_WIDTH_M
REACH_SIGMA = 0.06
# The same for an arm across the body, which the chest stops, 2.8 face widths.
REACH_ACROSS = 0.459 / FACE_WIDTH_M
REACH_ACROSS_SIGMA = 0.16
OFFSET_SIGMA = 0.2
LEAST_SIGMA_DEG = 8.0
# Visible length of the index finger against the bearing (foreshortened in front, hidden by the fist behind), and radius of the
# fist (larger toward the camera). Eased from hands of the rendered clips; wide, for they say little about other hands.
SHAPE_BEARINGS = np.array([0.0, 20.0, 40.0, 80.0, 100.0, 115.0, 135.0, 180.0])
FINGER_LENGTHS = np.array([0.08, 0.28, 0.52, 0.56, 0.34, 0.24, 0.08, 0.0])
FINGER_SIGMA = 0.11
PALM_RADII = np.array([0.33, 0.31, 0.27, 0.24, 0.24, 0.23, 0.20, 0.19])
PALM_SIGMA = 0.05
OUTLIERS = 0.15
GRID = np.arange(0.0, 151.0, 2.0)


@dataclass(frozen=True)
class Bearing:
    """Direction pointed to, degrees at the person, positive toward image right; `mirrored`: it may be 180 - b as well."""

    deg: float
    sigma_deg: float
    mirrored: bool


@dataclass(frozen=True)
class HandSight:
    """A pointing hand as seen: tip beside the face (positive toward image right), lengths of finger and palm; face widths."""

    offset: float
    finger: float
    palm: float


def estimate_bearing(sight: HandSight, distance: float, across: bool) -> Bearing:
    """Bearing of a pointing hand of a person `distance` face widths away; `across`: the arm crosses the body.

    Raises ValueError for a distance that is not positive.
    """
    if not distance > 0:
        raise ValueError(f"distance: {distance} face widths, must be positive")
    reach, spread = (REACH_ACROSS, REACH_ACROSS_SIGMA) if across else (REACH, REACH_SIGMA)
    radians = np.radians(GRID)
    depth = np.maximum(distance - reach * np.cos(radians), 0.3 * distance)
    expected = distance * reach * np.sin(radians) / depth
    # An offset beyond the model's largest is a long arm, not an impossible one.
    seen = min(abs(sight.offset), float(expected.max()))
    sigma = np.hypot(OFFSET_SIGMA, spread * expected)
    likelihood = np.exp(-0.5 * ((seen - expected) / sigma) ** 2) / sigma
    likelihood *= _tail_normal(sight.finger, FINGER_LENGTHS, FINGER_SIGMA) * _tail_normal(sight.palm, PALM_RADII, PALM_SIGMA)
    return _described(likelihood / likelihood.sum(), math.copysign(1.0, sight.offset))


def _tail_normal(seen: float, means: np.ndarray, sigma: float) -> np.ndarray:
    """Likelihood over the grid of a measure with these means at `SHAPE_BEARINGS`, and a share of outliers."""
    expected = np.interp(GRID, SHAPE_BEARINGS, means)
    return np.asarray((1 - OUTLIERS) * np.exp(-0.5 * ((seen - expected) / sigma) ** 2) + OUTLIERS)


def _described(posterior: np.ndarray, sign: float) -> Bearing:
    """The normal distribution, plain or folded at 90 degrees, that loses less of the posterior (cross-entropy)."""
    mean, sigma = _moments(GRID, posterior)
    folded_mean, folded_sigma = _moments(np.minimum(GRID, 180 - GRID), posterior)
    if 2 * folded_sigma < sigma:
        return Bearing(sign * folded_mean, folded_sigma, True)
    return Bearing(sign * mean, sigma, False)


def _moments(values: np.ndarray, weights: np.ndarray) -> tuple[float, float]:
    mean = float(weights @ values)
    return mean, max(LEAST_SIGMA_DEG, math.sqrt(float(weights @ (values - mean) ** 2)))
