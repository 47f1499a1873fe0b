"""Random numbers as the drawing of scenes needs them: rounded, so that a scene reads well as YAML and survives it exactly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")
Range = tuple[float, float]
"""Two numbers that something is drawn by: from and to, or standard deviation and limit."""


class Dice:
    """Draws from one generator. Every method draws once, whatever comes out, but `shuffled`."""

    def __init__(self, generator: np.random.Generator) -> None:
        self._generator = generator

    def between(self, low: float, high: float, digits: int = 3) -> float:
        """Uniform in low to high."""
        return round(low + (high - low) * float(self._generator.random()), digits)

    def between_log(self, low: float, high: float, digits: int = 3) -> float:
        """Uniform in the logarithm: as often halved as doubled."""
        return round(float(low * (high / low) ** self._generator.random()), digits)

    def near(self, mean: float, deviation: float, low: float, high: float, digits: int = 3) -> float:
        """Normal, held within low to high."""
        return round(min(max(float(self._generator.normal(mean, deviation)), low), high), digits)

    def whole(self, low: int, high: int) -> int:
        """A whole number, both ends included."""
        return int(self._generator.integers(low, high, endpoint=True))

    def chance(self, share: float) -> bool:
        """True in this share of the draws."""
        return float(self._generator.random()) < share

    def one(self, of: Sequence[T]) -> T:
        """One of them, all alike."""
        return of[self.whole(0, len(of) - 1)]

    def weighed(self, weights: Mapping[T, float]) -> T:
        """One of the keys, by weight."""
        names = list(weights)
        edges = np.cumsum([weights[name] for name in names])
        return names[int(np.searchsorted(edges, float(self._generator.random()) * edges[-1], side="right"))]

    def shuffled(self, of: Sequence[T]) -> list[T]:
        """All of them, in another order."""
        return [of[int(i)] for i in self._generator.permutation(len(of))]
