"""Bearing of a pointing from one camera: where the fingertip is seen beside the head, and whom that fits.

Turned round: for each bearing it is known where fingertip and fist are when people point there, near and far, high and low,
with arms straight, bent and from the hip, of their own side and across (`arms.npz`, six thousand arms of the simulator's
fitting people in widths of their own faces, by `fitting/fit_arms.py`). Seen from the camera at the person's distance each of
these arms puts its tip somewhere, and its finger beyond the fist; a bearing is as likely as its arms put theirs where both are
seen. Front and back are told apart as far as perspective, the height of the tip, and the size of the fist tell them apart.
The answer is the likelihood of bearings; its mean and standard deviation, plain or folded at 90 degrees (`mirrored`), are for
whoever wants one number. The same arms tell how high the pointing goes (`elevation_deg`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from deixis_schemas.messages import BEARING_STEP_DEG, Side
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

BEARINGS = np.arange(-180.0, 180.0, BEARING_STEP_DEG)
ARM_SIDES: tuple[Side | None, ...] = ("left", "right", None)
NEAR_DEG = 5.0
"""How far the arms of a bearing go on telling of its neighbours."""
TIP_SIGMA, FAR_TIP_SIGMA = 0.15, 0.03
"""How far off a tip is measured, face widths, and share of its distance from the head. By `fitting/choose_bearing.py`, as are
EXTENT_SIGMA, DIRECTION_SIGMA and OUTLIERS."""
NEAREST = 0.3
"""Of the person's distance: no arm comes nearer to the camera."""
NO_ARM = 0.005
"""Likelihood, beside the largest, of what no arm does."""
LOG_NOBODY, LOG_NEGLIGIBLE = -20.0, 14.0
"""Log of the fit below which a tip is nobody's; and arms so far below the likeliest are not looked at any closer."""
LEAST_SIGMA_DEG = 8.0
LEAST_EXTENT = 0.3
"""From the fist's middle to the end of its outline, face widths, where no finger shows."""
EXTENT_SIGMA, DIRECTION_SIGMA = 0.1, 0.35
"""How far off the way from the fist's middle to the fingertip is measured: its length, face widths, and direction, radians."""
# Radius of the fist against the bearing (larger toward the camera). Eased from hands of the rendered clips; it says little.
SHAPE_BEARINGS = np.array([0.0, 20.0, 40.0, 80.0, 100.0, 115.0, 135.0, 180.0])
PALM_RADII = np.array([0.33, 0.31, 0.27, 0.24, 0.24, 0.23, 0.20, 0.19])
PALM_SIGMA = 0.05
OUTLIERS = 0.1
"""Share of hands whose finger and palm tell nothing: the tracker lost them. By `fitting/choose_bearing.py`, whose clips are
hard ones, .3 or .5 would be a little better (3.07 nats at .1, 3.02 at .3, 3.01 at .5). On 14 plain strokes of the same people,
whose clips are not in the repository, they are worse (2.49, 2.61, 2.69).
"""


@dataclass(frozen=True)
class Bearing:
    """Direction pointed to, degrees at the person, positive toward image right; `mirrored`: it may be 180 - b as well.

    likelihood: of BEARINGS, its largest 1. elevation_deg: above the horizontal, at the head, with its standard deviation; none
    where no arm fits.
    """

    deg: float
    sigma_deg: float
    mirrored: bool
    likelihood: tuple[float, ...] = ()
    elevation_deg: float | None = None
    elevation_sigma_deg: float | None = None


@dataclass(frozen=True)
class HandSight:
    """A pointing hand as seen, face widths: tip, and the fist's middle, each beside the face's middle (positive toward image
    right) and below it; radius of the fist.
    """

    tip: tuple[float, float]
    fist: tuple[float, float]
    radius: float


@dataclass(frozen=True)
class Ray:
    """Where a level camera that looks at the head sees something. aside: tangent of the angle to the head seen from above,
    positive toward image right; slope: how much the sight of it rises for each length on the floor.
    """

    aside: float
    slope: float


@dataclass(frozen=True)
class ArmSight:
    """A pointing arm as a level camera sees it that looks at the head, lengths in face widths of the person.

    distance: to the head on the floor; height: of the head above the camera; radius: of the fist.
    """

    tip: Ray
    fist: Ray
    radius: float
    distance: float
    height: float


@dataclass(frozen=True)
class ArmFits:
    """Arms that fit (n,): their rows, and how well each does."""

    rows: NDArray[np.intp]
    fits: Floats


def estimate_bearing(seen: ArmSight, side: Side | None) -> Bearing:
    """Bearing of a pointing arm, the person's own `side` where that is known. Raises ValueError for no positive distance."""
    if not seen.distance > 0:
        raise ValueError(f"distance: {seen.distance} face widths, must be positive")
    arms = load_arms(side)
    found = fitting_arms(seen, arms)
    expected = np.interp(np.abs(BEARINGS), SHAPE_BEARINGS, PALM_RADII)
    palm = _with_outliers(np.exp(-0.5 * ((seen.radius - expected) / PALM_SIGMA) ** 2))
    likelihood = likelihood_of(found, arms) * palm
    told = _described(likelihood / likelihood.max())
    if found is None:
        return told
    elevation, spread = _moments(arms.elevations[found.rows], found.fits * (arms.share_of(found.rows) @ palm))
    return replace(told, elevation_deg=elevation, elevation_sigma_deg=max(LEAST_SIGMA_DEG, spread))


def fitting_arms(seen: ArmSight, arms: Arms) -> ArmFits | None:
    """Which arms put fingertip and fist about there, and how well each; none where nobody's arm does."""
    tips = _seen_at(arms.tips, seen)
    off = tips[:, :2] - np.array([seen.tip.aside, seen.tip.slope], np.float32)
    off *= tips[:, 2:]
    variances = TIP_SIGMA**2 + (FAR_TIP_SIGMA * arms.lengths) ** 2
    log_fits = -0.5 * np.einsum("ij,ij->i", off, off) / variances - np.log(variances)
    most = float(log_fits.max())
    if most < LOG_NOBODY:
        return None
    near = np.flatnonzero(log_fits > most - LOG_NEGLIGIBLE)
    ways = seen.distance * (tips[near] - _seen_at(arms.fists[near], seen))[:, :2]
    way = np.array([seen.tip.aside - seen.fist.aside, seen.tip.slope - seen.fist.slope])
    return ArmFits(near, np.exp(log_fits[near] - most) * _with_outliers(_finger_fits(ways, seen.distance * way)))


def likelihood_of(found: ArmFits | None, arms: Arms) -> Floats:
    """How likely each of BEARINGS puts fingertip and fist there, its largest 1; all alike where no arm does."""
    if found is None:
        return np.ones(len(BEARINGS))
    likelihood = found.fits @ arms.share_of(found.rows)
    return np.asarray((1 - NO_ARM) * likelihood / float(likelihood.max()) + NO_ARM)


def _seen_at(places: Floats, seen: ArmSight) -> Floats:
    """Of places (n, 3) about the head: aside, slope, and the distance on the floor (n, 3)."""
    ahead = np.maximum(seen.distance - places[:, 2], NEAREST * seen.distance)
    floor = np.hypot(ahead, places[:, 0])
    return np.stack([places[:, 0] / ahead, (seen.height + places[:, 1]) / floor, ahead], axis=1)


def _finger_fits(expected: Floats, way: Floats) -> Floats:
    """How well the way from fist to tip, face widths, is that which is expected of arms (n, 2), largest 1."""
    lengths, length = np.hypot(expected[:, 0], expected[:, 1]), float(np.hypot(*way))
    off = (np.maximum(lengths, LEAST_EXTENT) - max(length, LEAST_EXTENT)) / EXTENT_SIGMA
    cross = expected[:, 0] * way[1] - expected[:, 1] * way[0]
    turned = np.arctan2(cross, expected @ way) / DIRECTION_SIGMA
    # A finger that is hidden by its fist has no direction.
    clear = np.minimum(1.0, np.minimum(lengths, length) / LEAST_EXTENT)
    return np.asarray(np.exp(-0.5 * (off**2 + clear**2 * turned**2)))


@dataclass(frozen=True)
class Arms:
    """tips, fists (n, 3): right, up, toward the camera from the head; lengths (n,): of the way from there to the tip;
    elevations (n,): how high it points, degrees; rows (n,): where in `shares` it stands.

    shares (arms of both sides, bearings): to which bearing an arm counts, each column's sum 1. One array for all sides: it is
    by far the largest, 3.5 MB.
    """

    tips: Floats
    fists: Floats
    lengths: Floats
    elevations: Floats
    rows: NDArray[np.intp]
    shares: Floats

    def share_of(self, chosen: NDArray[np.intp]) -> Floats:
        """To which bearing each of some of these arms counts (chosen, bearings)."""
        return np.asarray(self.shares[self.rows[chosen]])


@cache
def load_arms(side: Side | None) -> Arms:
    """The arms of a side, and the mirror images of the other, for either hand does the same; of both where it is not known."""
    if side is None:
        return _all_arms()[0]
    both, is_left = _all_arms()
    rows = np.flatnonzero(is_left == (side == "left"))
    return replace(
        both,
        tips=both.tips[rows],
        fists=both.fists[rows],
        lengths=both.lengths[rows],
        elevations=both.elevations[rows],
        rows=rows,
    )


@cache
def _all_arms() -> tuple[Arms, NDArray[np.bool_]]:
    """The arms of both sides, and which of them are left ones."""
    with files("deixis_gesture").joinpath("arms.npz").open("rb") as file:
        stored = np.load(file)
        bearings, left, elevations = (stored[name] for name in ("bearings_deg", "left", "elevations_deg"))
        tips, fists = (np.concatenate([at, at * (-1, 1, 1)]).astype(np.float32) for at in (stored["tips"], stored["fists"]))
    elevations = np.concatenate([elevations, elevations]).astype(np.float32)
    shares = _shares(np.concatenate([bearings, -bearings]).astype(np.float32))
    arms = Arms(tips, fists, np.linalg.norm(tips, axis=1), elevations, np.arange(len(tips)), shares)
    return arms, np.concatenate([left, ~left])


def _shares(bearings: Floats) -> Floats:
    """To which of BEARINGS arms of these count. In place: each step in an array of its own took 7 MB."""
    shares = BEARINGS - bearings[:, None] + 180
    np.remainder(shares, 360, out=shares)
    shares -= 180
    shares /= NEAR_DEG
    np.square(shares, out=shares)
    shares *= -0.5
    np.exp(shares, out=shares)
    shares /= shares.sum(axis=0)
    return shares.astype(np.float32)


def _with_outliers(fits: Floats) -> Floats:
    """A likelihood, largest 1, of what a share of hands does not keep to."""
    return np.asarray((1 - OUTLIERS) * fits + OUTLIERS)


def _described(likelihood: Floats) -> Bearing:
    """The normal distribution, plain or folded at 90 degrees, that loses less of the likelihood."""
    mean, sigma = _moments(BEARINGS, likelihood)
    folded = np.where(np.abs(BEARINGS) > 90, np.sign(BEARINGS) * 180 - BEARINGS, BEARINGS)
    folded_mean, folded_sigma = _moments(folded, likelihood)
    told = tuple(round(float(value), 4) for value in likelihood)
    if 2 * folded_sigma < sigma:
        return Bearing(folded_mean, max(LEAST_SIGMA_DEG, folded_sigma), True, told)
    return Bearing(mean, max(LEAST_SIGMA_DEG, sigma), False, told)


def _moments(values: Floats, weights: Floats) -> tuple[float, float]:
    """Mean and standard deviation of angles, degrees, on the circle about their mean."""
    weights = weights / weights.sum()
    radians = np.radians(values)
    mean = math.degrees(math.atan2(float(weights @ np.sin(radians)), float(weights @ np.cos(radians))))
    off = (values - mean + 180) % 360 - 180
    return mean, math.sqrt(float(weights @ off**2))
