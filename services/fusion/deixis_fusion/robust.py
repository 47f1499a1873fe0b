"""Weighted frames: consecutive ones show nearly the same picture, so their errors are the same.

Multiplying the likelihoods of thirty frames would count one observation thirty times. Over a stroke gestures are put to the
vote and angles to the median, with a sigma that does not shrink with the number of frames.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .evidence import Sample
from .frames import EARLY_WEIGHT, FULL_TURN_DEG, ROUNDING, Frames, Values, wrapped
from .localisation import wrapped_deg

# Median absolute deviation to standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826


class Middle(NamedTuple):
    """A direction and a height that were measured in many frames, each with its sigma; degrees, none where no frame told."""

    direction_deg: float | None
    sigma_deg: float | None
    height_deg: float | None
    height_sigma_deg: float | None


def weigh(samples: Sequence[Sample], settle_s: float) -> Frames:
    """The frames of a stroke with their weights: at the start of a stroke the head may still be on its way."""
    frames = Frames.of(samples)
    if not samples:
        return frames
    at_ns = frames.column("at_ns")
    return Frames.of(frames.log, int(at_ns.searchsorted(at_ns[0] + settle_s * 1e9)))


def middles_of(measured: Values, early: int) -> list[Middle]:
    """What frames measured together, of each source (4 m, n): directions, their stated sigmas, heights and theirs.

    Medians; each sigma is the median of those stated, with the spread of the frames. The first `early` frames count for less;
    what is not a number was not told. Directions lie on a circle, and are ordered around their mean, so that it does not matter
    where that is cut.
    """
    cut = [uncut(directions, early) for directions in measured[::4]]
    found = medians(measured, early)
    away = np.abs(measured[::2] - np.array(found[::2])[:, None])
    if any(cut):
        np.minimum(away[::2], FULL_TURN_DEG - away[::2], out=away[::2])
    spreads = medians(away, early)
    angles = [_angle(*told) for told in zip(found[::2], found[1::2], spreads, strict=True)]
    return [Middle(*direction, *height) for direction, height in zip(angles[::2], angles[1::2], strict=True)]


def _angle(middle: float, stated: float, spread: float) -> tuple[float, float] | tuple[None, None]:
    """An angle with its sigma, from medians; none where no frame told it."""
    return (None, None) if math.isnan(middle) else (wrapped_deg(middle), math.hypot(stated, MAD_TO_SIGMA * spread))


def uncut(angles_deg: Values, early: int = 0) -> bool:
    """Turn angles (n) fully, so that the circle is cut where none of them is, or opposite to their mean.

    Returns whether some may be more than half a turn apart.
    """
    if not np.fmax.reduce(angles_deg) - np.fmin.reduce(angles_deg) >= FULL_TURN_DEG / 2:
        return False
    told = ~np.isnan(angles_deg)
    radians, weights = np.radians(np.where(told, angles_deg, 0.0)), told.astype(np.float64)
    weights[:early] *= EARLY_WEIGHT
    mean = float(np.degrees(np.arctan2(weights @ np.sin(radians), weights @ np.cos(radians))))
    angles_deg[:] = mean + wrapped(angles_deg - mean)
    return True


def medians(values: Values, early: int = 0) -> list[float]:
    """Weighted median of each row (m, n), of what is a number in it; not a number where nothing is. Of as many on either side
    it is the lower one.

    The first `early` columns count for less.
    """
    ordered = values.copy()
    late, first = ordered[:, early:], ordered[:, :early]
    late.sort(axis=1)
    first.sort(axis=1)
    # What is not a number comes last.
    if np.isnan(ordered[:, -1:]).any() or np.isnan(first).any():
        unknown = np.isnan(late).sum(axis=1).tolist()
        known = [[value for value in few if not math.isnan(value)] for few in first.tolist()]
        each = zip(late, unknown, known, strict=True)
        return [_medians(row[None, : len(row) - gone], [few])[0] for row, gone, few in each]
    return _medians(late, first.tolist())


def _medians(late: Values, early: list[list[float]]) -> list[float]:
    """Weighted medians of rows in order, of which those of `early` count for less."""
    count, of_early = late.shape[1], EARLY_WEIGHT * len(early[0])
    half = (count + of_early) * (0.5 - ROUNDING)
    # Where the weights up to a late value can reach half of all at the earliest; before it, none does.
    i = max(0, math.ceil(half - of_early) - 1)
    if not early[0]:
        middle: list[float] = late[:, i].tolist() if count else [math.nan] * len(late)
        return middle
    near = late[:, max(0, i - 1) : i + len(early[0]) + 1].tolist()
    return [_crossing(row, few, i, half) for row, few in zip(near, early, strict=True)]


def _crossing(near: list[float], early: list[float], before: int, half: float) -> float:
    """The value up to which weights reach `half`, of late values `near` it, before the second of which there are `before`."""
    i, j = (1, bisect_right(early, near[0])) if before else (0, 0)
    reached = before + EARLY_WEIGHT * j
    while True:
        if i < len(near) and (j == len(early) or near[i] <= early[j]):
            value, reached, i = near[i], reached + 1, i + 1
        else:
            value, reached, j = early[j], reached + EARLY_WEIGHT, j + 1
        if reached >= half:
            return value
