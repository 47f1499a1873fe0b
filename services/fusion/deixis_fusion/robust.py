"""Weighted frames: consecutive ones show nearly the same picture, so their errors are the same.

Multiplying the likelihoods of thirty frames would count one observation thirty times. Over a stroke gestures are put to the
vote and angles to the median, with a sigma that does not shrink with the number of frames.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .evidence import Sample
from .frames import Frames, Values, wrapped
from .localisation import wrapped_deg

UNSETTLED_WEIGHT = 0.2
# Median absolute deviation to standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826
# Of sums of weights: of as many on either side the lower one is the median, whatever rounding does.
ROUNDING = 1e-9


def weigh(samples: Sequence[Sample], settle_s: float) -> Frames:
    """The frames of a stroke with their weights: at the start of a stroke the head may still be on its way."""
    frames = Frames.of(samples)
    if not samples:
        return frames
    at_ns = frames.column("at_ns")
    return frames.weighed(np.where(at_ns >= at_ns[0] + settle_s * 1e9, 1.0, UNSETTLED_WEIGHT))


def median_angle(angles_deg: Values, weights: Values) -> tuple[float, float]:
    """Weighted median of angles, degrees within -180 and 180, and their spread from it as a standard deviation.

    Angles are ordered around their mean direction, so that it does not matter where the circle is cut.
    """
    radians = np.radians(angles_deg)
    mean = float(np.degrees(np.arctan2(weights @ np.sin(radians), weights @ np.cos(radians))))
    off = wrapped(angles_deg - mean)
    centre = median(off, weights)
    spread = median(np.abs(wrapped(off - centre)), weights)
    return wrapped_deg(mean + centre), MAD_TO_SIGMA * spread


def median_and_spread(values: Values, weights: Values) -> tuple[float, float]:
    """Weighted median of values that lie on no circle, and their spread from it as a standard deviation."""
    centre = median(values, weights)
    return centre, MAD_TO_SIGMA * median(np.abs(values - centre), weights)


def median(values: Values, weights: Values) -> float:
    """Weighted median of these values, one at least."""
    order = values.argsort(kind="stable")
    reached = weights[order].cumsum()
    middle = int(reached.searchsorted(reached[-1] * (0.5 - ROUNDING)))
    return float(values[order[middle]])


def majority(choices: Values, weights: Values) -> int | None:
    """The choice (0, 1 ...) of the largest total weight, the earlier one of equals; of none, none."""
    if not len(choices):
        return None
    chosen = choices.astype(np.intp)
    totals = np.bincount(chosen, weights)
    return int(chosen[totals[chosen].argmax()])
