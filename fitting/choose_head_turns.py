"""Chooses how far heads turn toward what is pointed at: the gains, `full_turn`, `at_robot` and `outlier` of fusion's `head`.

usage: python fitting/choose_head_turns.py [--arms N] [--check]

The simulator lets N people of its fitting avatars point all around (`deixis_simulation.pointing_arms`); the best settings make
the places pointed at likeliest, given where heads are turned, as badly as headpose reads them. One setting is tried at a time,
the others as they are best so far, twice. With --check: how likely the settings that are there make those of people who were
held out. No picture is rendered; a thousand people take a minute on one core.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
from deixis_fusion.config import HeadConfig
from deixis_fusion.curves import at, head_curve
from deixis_fusion.evidence import HeadObservation
from numpy.typing import NDArray

Angles = NDArray[np.floating[Any]]
PART = 250
MISSED_DEG = 4.0
"""How far off yaw is read, degrees, which its stated sigma says."""
RANGE_DEG = 120.0
TRIED: dict[str, tuple[float, ...]] = {
    "gain_min": (0.2, 0.3, 0.4, 0.5, 0.65),
    "gain_max": (1.0, 1.05, 1.1),
    "full_turn": (0.05, 0.1, 0.2, 0.3, 0.4, 0.65),
    "at_robot": (0.03, 0.06, 0.1, 0.15),
    "outlier": (0.03, 0.05, 0.08, 0.12),
}
ROUNDS = 2


def main() -> int:
    """Draw, try, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", type=int, default=2000, help="how many (default: 2000)")
    parser.add_argument("--check", action="store_true", help="say how well the settings that are there do on held-out people")
    given = parser.parse_args()
    first = 1001 if given.check else 101
    bearings, yaws = drawn([(seed, not given.check) for seed in range(first, first + -(-given.arms // PART))])
    before = HeadConfig()
    print(f"{len(bearings)} people; as it is: {loss(before, bearings, yaws):.3f} nats")
    if not given.check:
        print_best(before, bearings, yaws)
    return 0


def print_best(settings: HeadConfig, bearings: Angles, yaws: Angles) -> None:
    """Try each setting with the others as they are best so far."""
    for _ in range(ROUNDS):
        for name, values in TRIED.items():
            losses = {value: loss(settings.model_copy(update={name: value}), bearings, yaws) for value in values}
            best = min(losses, key=lambda value: losses[value])
            settings = settings.model_copy(update={name: best})
            print(f"{name}: " + ", ".join(f"{value:g}: {told:.3f}" for value, told in losses.items()) + f"; best {best:g}")


def loss(settings: HeadConfig, bearings: Angles, yaws: Angles) -> float:
    """Mean of -log P(where was pointed | yaw), nats, with all bearings alike before."""
    rng, told = np.random.default_rng(0), []
    for bearing, yaw in zip(bearings, yaws, strict=True):
        read = float(yaw + rng.normal(0, MISSED_DEG))
        if abs(read) <= RANGE_DEG:
            curve = head_curve(HeadObservation(read, MISSED_DEG), settings)
            told.append(float(np.log(at(curve[None], np.array([bearing]))[0, 0] / curve.sum())))
    return -float(np.mean(told))


def drawn(parts: list[tuple[int, bool]]) -> tuple[Angles, Angles]:
    """Bearings of POIs and yaws of heads (n,), degrees, of these seeds' people."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        bearings, yaws = zip(*pool.map(_part, parts), strict=True)
    return np.concatenate(bearings), np.concatenate(yaws)


def _part(job: tuple[int, bool]) -> tuple[Angles, Angles]:
    from deixis_simulation.avatars import FITTING_AVATARS, HELD_OUT_AVATARS  # noqa: PLC0415 (in the process that draws)
    from deixis_simulation.pointing_arms import pointing_arms  # noqa: PLC0415

    seed, fitting = job
    arms = list(pointing_arms(seed, FITTING_AVATARS if fitting else HELD_OUT_AVATARS, PART))
    return np.array([arm.bearing_deg for arm in arms]), np.array([arm.yaw_deg for arm in arms])


if __name__ == "__main__":
    raise SystemExit(main())
