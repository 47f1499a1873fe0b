"""Whether a quantity sampled over time stays flat: a robust slope with its interval, and a verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Verdict = Literal["flat", "grows", "undecided"]

NORMAL_95 = 1.96
FEWEST_BINS = 8


@dataclass(frozen=True)
class Slope:
    """Growth an hour: Theil-Sen's slope and the interval that holds it in 95 of 100 cases."""

    per_hour: float
    low: float
    high: float

    def verdict(self, limit: float) -> Verdict:
        """Whether the growth is certainly within the limit, certainly above it, or neither yet."""
        if self.high <= limit:
            return "flat"
        return "grows" if self.low > limit else "undecided"


def binned(times_s: Sequence[float], values: Sequence[float], bin_s: float) -> tuple[list[float], list[float]]:
    """Medians of times and values over pieces of `bin_s` seconds.

    Samples that follow each other closely are not independent, which the interval takes them to be.
    """
    pieces: dict[int, list[tuple[float, float]]] = {}
    for at_s, value in zip(times_s, values, strict=True):
        pieces.setdefault(int((at_s - times_s[0]) // bin_s), []).append((at_s, value))
    medians = [np.median(np.array(piece), axis=0) for _, piece in sorted(pieces.items())]
    return [float(at_s) for at_s, _ in medians], [float(value) for _, value in medians]


def theil_sen(times_s: Sequence[float], values: Sequence[float]) -> Slope | None:
    """The median of the slopes between all pairs, with the interval by Kendall's statistic; None for too few values."""
    n = len(values)
    if n < FEWEST_BINS:
        return None
    slopes = np.sort(_slopes_per_hour(np.array(times_s), np.array(values)))
    half_width = NORMAL_95 * math.sqrt(n * (n - 1) * (2 * n + 5) / 18)
    low = max(0, math.floor((len(slopes) - half_width) / 2))
    high = min(len(slopes) - 1, math.ceil((len(slopes) + half_width) / 2))
    return Slope(float(np.median(slopes)), float(slopes[low]), float(slopes[high]))


def _slopes_per_hour(times_s: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    sooner, later = np.triu_indices(len(values), 1)
    slopes: NDArray[np.float64] = (values[later] - values[sooner]) / (times_s[later] - times_s[sooner]) * 3600
    return slopes
