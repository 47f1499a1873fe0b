"""Bearing of a pointing from one camera: where the fingertip is seen beside the head, and whom that fits.

Turned round: for each bearing it is known where fingertips are when people point there, near and far, high and low, with arms
straight, bent and from the hip, of their own side and across (`arms.npz`, six thousand arms of the simulator's fitting people
in widths of their own faces, by `fitting/fit_arms.py`). Seen from the camera at the person's distance each of these arms puts
its tip somewhere; a bearing is as likely as its arms put theirs where the tip is seen. Front and back are told apart as far as
perspective, the height of the tip, and the size of fist and finger tell them apart. The answer is the likelihood of bearings;
its mean and standard deviation, plain or folded at 90 degrees (`mirrored`), are for whoever wants one number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from deixis_schemas.messages import BEARING_STEP_DEG, Side
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

BEARINGS = np.arange(-180.0, 180.0, BEARING_STEP_DEG)
NEAR_DEG = 5.0
"""How far the arms of a bearing go on telling of its neighbours."""
TIP_SIGMA, FAR_TIP_SIGMA = 0.22, 0.05
"""How far off a tip is measured, face widths, and share of its distance from the head: outlines end about the fingertip."""
NEAREST = 0.3
"""Of the person's distance: no arm comes nearer to the camera."""
NO_ARM = 0.005
"""Likelihood, beside the largest, of what no arm does."""
LEAST_SIGMA_DEG = 8.0
# Visible length of the index finger against the bearing (foreshortened in front, hidden by the fist behind), and radius of the
# fist (larger toward the camera). Eased from hands of the rendered clips; they say little: fingers are lost at any bearing.
SHAPE_BEARINGS = np.array([0.0, 20.0, 40.0, 80.0, 100.0, 115.0, 135.0, 180.0])
FINGER_LENGTHS = np.array([0.08, 0.28, 0.52, 0.56, 0.34, 0.24, 0.08, 0.0])
FINGER_SIGMA = 0.11
PALM_RADII = np.array([0.33, 0.31, 0.27, 0.24, 0.24, 0.23, 0.20, 0.19])
PALM_SIGMA = 0.05
OUTLIERS = 0.3
"""Share of hands whose finger and palm tell nothing. By `fitting/choose_outliers.py` more would be better (3.80 nats at .15,
3.66 at .3, 3.51 at .7): far away the tracker loses fingers at any bearing. On the labelled clips less would: 2.77, 2.76, 2.80.
"""


@dataclass(frozen=True)
class Bearing:
    """Direction pointed to, degrees at the person, positive toward image right; `mirrored`: it may be 180 - b as well.

    likelihood: of BEARINGS, its largest 1.
    """

    deg: float
    sigma_deg: float
    mirrored: bool
    likelihood: tuple[float, ...] = ()


@dataclass(frozen=True)
class HandSight:
    """A pointing hand as seen: tip beside the face's middle (positive toward image right) and below it, lengths of finger and
    palm; face widths.
    """

    offset: float
    drop: float
    finger: float
    palm: float


@dataclass(frozen=True)
class TipSight:
    """A tip as a level camera sees it that looks at the head, lengths in face widths of the person.

    aside: tangent of the angle between head and tip seen from above, positive toward image right; slope: how much the sight of
    the tip rises for each length on the floor. distance: to the head on the floor; height: of the head above the camera.
    """

    aside: float
    slope: float
    distance: float
    height: float


def estimate_bearing(sight: HandSight, tip: TipSight, side: Side | None) -> Bearing:
    """Bearing of a pointing hand, the person's own `side` where that is known. Raises ValueError for no positive distance."""
    if not tip.distance > 0:
        raise ValueError(f"distance: {tip.distance} face widths, must be positive")
    likelihood = arms_likelihood(tip, side)
    size = np.abs(BEARINGS)
    likelihood = likelihood * _tail_normal(sight.finger, size, FINGER_LENGTHS, FINGER_SIGMA)
    likelihood = likelihood * _tail_normal(sight.palm, size, PALM_RADII, PALM_SIGMA)
    return _described(likelihood / likelihood.max())


def arms_likelihood(tip: TipSight, side: Side | None) -> Floats:
    """How likely each of BEARINGS puts a fingertip there, its largest 1."""
    arms = load_arms()
    ahead = np.maximum(tip.distance - arms.tips[:, 2], NEAREST * tip.distance)
    aside = arms.tips[:, 0] - tip.aside * ahead
    off = tip.height + arms.tips[:, 1] - tip.slope * np.hypot(ahead, arms.tips[:, 0])
    sigma = np.hypot(TIP_SIGMA, FAR_TIP_SIGMA * arms.lengths)
    fits = np.exp(-0.5 * (aside**2 + off**2) / sigma**2) / sigma**2
    if side is not None:
        fits = np.where(arms.left == (side == "left"), fits, 0.0)
    likelihood = arms.share @ fits
    most = float(likelihood.max())
    if most < 1e-12:  # nobody's arm: nothing is told
        return np.ones(len(BEARINGS))
    return np.asarray((1 - NO_ARM) * likelihood / most + NO_ARM)


@dataclass(frozen=True)
class Arms:
    """tips (n, 3): right, up, toward the camera from the head; left (n,); lengths (n,); share (bearings, n): to which bearing
    an arm counts, each row's sum 1.
    """

    tips: Floats
    left: NDArray[np.bool_]
    lengths: Floats
    share: Floats


@cache
def load_arms() -> Arms:
    """The arms and their mirror images, for either hand does the same."""
    with files("deixis_gesture").joinpath("arms.npz").open("rb") as file:
        stored = np.load(file)
        bearings, left, tips = (stored[name] for name in ("bearings_deg", "left", "tips"))
    bearings = np.concatenate([bearings, -bearings]).astype(np.float32)
    tips = np.concatenate([tips, tips * (-1, 1, 1)]).astype(np.float32)
    off = (BEARINGS[:, None] - bearings + 180) % 360 - 180
    share = np.exp(-0.5 * (off / NEAR_DEG) ** 2)
    share = (share / share.sum(axis=1, keepdims=True)).astype(np.float32)
    return Arms(tips, np.concatenate([left, ~left]), np.linalg.norm(tips, axis=1), share)


def _tail_normal(seen: float, size: Floats, means: Floats, sigma: float) -> Floats:
    """Likelihood of a measure with these means at `SHAPE_BEARINGS`, and a share of outliers."""
    expected = np.interp(size, SHAPE_BEARINGS, means)
    return np.asarray((1 - OUTLIERS) * np.exp(-0.5 * ((seen - expected) / sigma) ** 2) + OUTLIERS)


def _described(likelihood: Floats) -> Bearing:
    """The normal distribution, plain or folded at 90 degrees, that loses less of the likelihood."""
    weights = likelihood / likelihood.sum()
    mean, sigma = _moments(BEARINGS, weights)
    folded = np.where(np.abs(BEARINGS) > 90, np.sign(BEARINGS) * 180 - BEARINGS, BEARINGS)
    folded_mean, folded_sigma = _moments(folded, weights)
    told = tuple(round(float(value), 4) for value in likelihood)
    if 2 * folded_sigma < sigma:
        return Bearing(folded_mean, max(LEAST_SIGMA_DEG, folded_sigma), True, told)
    return Bearing(mean, max(LEAST_SIGMA_DEG, sigma), False, told)


def _moments(values: Floats, weights: Floats) -> tuple[float, float]:
    """Mean and standard deviation of angles, degrees, on the circle about their mean."""
    radians = np.radians(values)
    mean = math.degrees(math.atan2(float(weights @ np.sin(radians)), float(weights @ np.cos(radians))))
    off = (values - mean + 180) % 360 - 180
    return mean, math.sqrt(float(weights @ off**2))
