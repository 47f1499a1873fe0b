"""Weighted frames: consecutive ones show nearly the same picture, so their errors are the same.

Multiplying the likelihoods of thirty frames would count one observation thirty times. Over a stroke gestures are put to the
vote and angles to the median, with a sigma that does not shrink with the number of frames.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

from .evidence import Sample, Weighed
from .localisation import wrapped_deg

T = TypeVar("T")

UNSETTLED_WEIGHT = 0.2
# Median absolute deviation to standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826


def weigh(samples: Sequence[Sample], settle_s: float) -> Weighed:
    """The samples of a stroke with their weights: at the start of a stroke the head may still be on its way."""
    if not samples:
        return []
    settled_ns = samples[0].at_ns + int(settle_s * 1e9)
    return [(sample, 1.0 if sample.at_ns >= settled_ns else UNSETTLED_WEIGHT) for sample in samples]


def median_angle(weighted: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Weighted median of angles, degrees within -180 and 180, and their spread from it as a standard deviation.

    Angles are ordered around their mean direction, so that it does not matter where the circle is cut.
    """
    sine = math.fsum(weight * math.sin(math.radians(angle)) for angle, weight in weighted)
    cosine = math.fsum(weight * math.cos(math.radians(angle)) for angle, weight in weighted)
    mean = math.degrees(math.atan2(sine, cosine))
    centre = median([(wrapped_deg(angle - mean), weight) for angle, weight in weighted])
    spread = median([(abs(wrapped_deg(angle - mean) - centre), weight) for angle, weight in weighted])
    return wrapped_deg(mean + centre), MAD_TO_SIGMA * spread


def median(weighted: Sequence[tuple[float, float]]) -> float:
    """Weighted median."""
    ordered = sorted(weighted)
    half = math.fsum(weight for _, weight in ordered) / 2
    reached = 0.0
    for value, weight in ordered:
        reached += weight
        if reached >= half:
            return value
    return ordered[-1][0]


def majority(weighted: Sequence[tuple[T, float]]) -> T | None:
    """The value of the largest total weight; the earlier one of equals."""
    totals: dict[T, float] = {}
    for value, weight in weighted:
        totals[value] = totals.get(value, 0.0) + weight
    return max(totals, key=lambda value: totals[value]) if totals else None
