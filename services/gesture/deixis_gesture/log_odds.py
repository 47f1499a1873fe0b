"""Log odds that add up: each measure, or pair of them, has a table, and what the tables say is summed (a generalised additive
model). So it can be said of every answer which measure spoke for it and which against it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Table:
    """Values at the crossings of the knots of one or two axes; between them interpolated, beyond them kept."""

    axes: tuple[Floats, ...]
    values: Floats

    def at(self, *place: float) -> float:
        """What it says of a place, one coordinate an axis."""
        return float(weights_at(self.axes, place) @ self.values.ravel())


def weights_at(axes: tuple[Floats, ...], place: tuple[float, ...]) -> Floats:
    """How much each crossing of the knots counts at a place; their sum is 1."""
    weights = _hats(axes[0], place[0])
    for knots, value in zip(axes[1:], place[1:], strict=True):
        weights = np.outer(weights, _hats(knots, value)).ravel()
    return weights


def _hats(knots: Floats, value: float) -> Floats:
    at = float(np.interp(value, knots, np.arange(len(knots))))
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(np.arange(len(knots)) - at)))


@dataclass(frozen=True)
class LogOdds:
    """A constant, and tables by name."""

    constant: float
    tables: Mapping[str, Table]

    def parts(self, measures: Mapping[str, tuple[float, ...]]) -> dict[str, float]:
        """What each table says of the measures; one that is not measured says nothing."""
        return {name: table.at(*measures[name]) for name, table in self.tables.items() if name in measures}
