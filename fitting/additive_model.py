"""Fits log odds that add up (`deixis_gesture/log_odds.py`): a logistic regression on the crossings of their tables.

Neighbours in a table are held together and all values near zero, by so much that it fits other people best; the regression is
convex, so the same data give the same tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from deixis_gesture.log_odds import LogOdds, Table, weights_at
from deixis_gesture.pointing_odds import Knots, Measures
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
ROUNDS, LARGEST_STEP, SMALL_STEP = 60, 3.0, 1e-5


@dataclass(frozen=True)
class Stiffness:
    """How much a table is held: neighbours to each other, and values to zero."""

    neighbours: float
    values: float


def fit(knots: Knots, measured: Sequence[Measures], points: Floats, weights: Floats, stiffness: Stiffness) -> LogOdds:
    """The tables that make `points` (n,) of 0 and 1 likeliest, each case with its weight (n,)."""
    design, held = design_of(knots, measured), _penalty(knots, stiffness)
    values = np.zeros(design.shape[1])
    for _ in range(ROUNDS):
        probability = 1 / (1 + np.exp(-np.clip(design @ values, -40, 40)))
        slope = design.T @ (weights * (points - probability)) - held @ values
        curvature = (design * (weights * probability * (1 - probability))[:, None]).T @ design + held
        step = np.linalg.solve(curvature + 1e-6 * np.eye(len(values)), slope)
        values += np.clip(step, -LARGEST_STEP, LARGEST_STEP)
        if float(np.abs(step).max()) < SMALL_STEP:
            break
    return _as_tables(knots, values)


def log_odds_of(model: LogOdds, knots: Knots, measured: Sequence[Measures]) -> Floats:
    """What a model says of each case (n,)."""
    values = np.concatenate([*(model.tables[name].values.ravel() for name in knots), [model.constant]])
    return np.asarray(design_of(knots, measured) @ values)


def log_loss(told: Floats, points: Floats, weights: Floats) -> float:
    """Mean of -log P(what was the case), nats."""
    return float((weights * np.logaddexp(0, np.where(points > 0, -told, told))).sum() / weights.sum())


def design_of(knots: Knots, measured: Sequence[Measures]) -> Floats:
    """One row a case: how much each crossing counts, and 1 for the constant."""
    axes = {name: tuple(np.array(axis) for axis in given) for name, given in knots.items()}
    places, size = {}, 0
    for name, given in axes.items():
        places[name] = slice(size, size := size + int(np.prod([len(axis) for axis in given])))
    design = np.zeros((len(measured), size + 1))
    design[:, -1] = 1
    for row, measures in enumerate(measured):
        for name, place in measures.items():
            design[row, places[name]] = weights_at(axes[name], place)
    return design


def _penalty(knots: Knots, stiffness: Stiffness) -> Floats:
    blocks = [_penalty_of([len(axis) for axis in axes], stiffness) for axes in knots.values()]
    size = sum(len(block) for block in blocks)
    penalty, at = np.zeros((size + 1, size + 1)), 0
    for block in blocks:
        penalty[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return penalty


def _penalty_of(shape: list[int], stiffness: Stiffness) -> Floats:
    numbers = np.arange(int(np.prod(shape))).reshape(shape)
    penalty = stiffness.values * np.eye(numbers.size)
    for axis, length in enumerate(shape):
        first = np.take(numbers, range(length - 1), axis=axis).ravel()
        second = np.take(numbers, range(1, length), axis=axis).ravel()
        for a, b in zip(first, second, strict=True):
            penalty[[a, b], [a, b]] += stiffness.neighbours
            penalty[[a, b], [b, a]] -= stiffness.neighbours
    return penalty


def _as_tables(knots: Knots, values: Floats) -> LogOdds:
    tables, at = {}, 0
    for name, axes in knots.items():
        shape = [len(axis) for axis in axes]
        size = int(np.prod(shape))
        tables[name] = Table(tuple(np.array(axis) for axis in axes), values[at : at + size].reshape(shape))
        at += size
    return LogOdds(float(values[-1]), tables)
