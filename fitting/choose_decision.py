"""Chooses how fusion decides: `answer.tempering`, `tie_ratio`, `max_conflict` and `least_fit`; and shows how well chances hold.

usage: python fitting/choose_decision.py [--strokes N] [--seed S]

Strokes are made up (`drawn_strokes.py`), half by fusion's own model, half by a worse one, with 2 to 30 POIs.
* tempering: by the log loss of the POI meant, and the calibration error (ECE, ten bins) of the likeliest;
* reliability: of the likeliest POI's chance by the product of likelihoods, and of its pignistic probability by the masses;
* tie_ratio: what part is named, tied or not answered, and how often the answer is wrong;
* limits: what part of strokes is beyond `max_conflict` or `least_fit`, when all is well and when no POI in sight is meant.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from deixis_fusion.config import FusionConfig
from deixis_fusion.deixis_rules import DeixisRules, likeliest
from deixis_fusion.weighing import Weighing, weigh
from drawn_strokes import Stroke, World, draw

Values = npt.NDArray[np.float64]
NUMBERS = (2, 4, 8, 15, 30)
TEMPERINGS = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
RATIOS = (0.8, 0.65, 0.5, 0.4, 0.3, 0.2)
BINS = 10


class Weighed(NamedTuple):
    """A stroke, weighed."""

    stroke: Stroke
    weighing: Weighing
    pignistic: Values


def main() -> int:
    """Draw, weigh and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strokes", type=int, default=1000, help="for each number of POIs and each model (default: 1000)")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    config, rng = FusionConfig(), np.random.default_rng(given.seed)
    worlds = {"own": World.own(config), "worse": World.worse(config)}
    strokes = {name: weighed(given.strokes, world, config, rng) for name, world in worlds.items()}
    print_temperings(strokes)
    print_reliability(strokes, config.answer.tempering)
    print_ties(strokes, config.answer.tempering)
    print_limits(strokes, weighed(given.strokes, worlds["worse"], config, rng, away=True), config)
    return 0


def weighed(count: int, world: World, config: FusionConfig, rng: np.random.Generator, away: bool = False) -> list[Weighed]:
    """So many strokes for each number of POIs."""
    rules, found = DeixisRules(config.hand, config.head, config.answer), []
    for number in NUMBERS:
        for _ in range(count):
            stroke = draw(number, world, config, rng, away)
            weighing = weigh(stroke.evidence, stroke.seen, rules.curves)
            found.append(Weighed(stroke, weighing, rules.judge(stroke.seen, stroke.evidence).pignistic))
    return found


def print_temperings(strokes: dict[str, list[Weighed]]) -> None:
    """Log loss and calibration error of each."""
    print("tempering   log loss own, worse, both     ECE own, worse")
    for tempering in TEMPERINGS:
        losses, errors = [], []
        for of_world in strokes.values():
            chances = [item.weighing.chances(tempering) for item in of_world]
            losses.append(_log_loss(of_world, chances))
            errors.append(_calibration_error(of_world, chances))
        print(
            f"{tempering:9.2f}   {losses[0]:8.3f} {losses[1]:6.3f} {np.mean(losses):6.3f}     {errors[0]:7.3f} {errors[1]:6.3f}"
        )


def print_reliability(strokes: dict[str, list[Weighed]], tempering: float) -> None:
    """How often the likeliest POI is the one meant, by how likely it is said to be."""
    print(f"\nreliability (tempering {tempering:g}): said -> true (strokes)")
    for name, of_world in strokes.items():
        for what, shares in (
            ("product", [item.weighing.chances(tempering) for item in of_world]),
            ("masses", [item.pignistic for item in of_world]),
        ):
            bins = "  ".join(f"{said:.2f}->{true:.2f} ({count})" for said, true, count in _reliability(of_world, shares))
            print(f"  {name:5s} {what:7s} ECE {_calibration_error(of_world, shares):.3f}: {bins}")


def print_ties(strokes: dict[str, list[Weighed]], tempering: float) -> None:
    """What each ratio answers, with up to three tied."""
    print("\ntie_ratio   of all: named, tied (2 or 3), too many;   wrong of the named, of the tied")
    for ratio in RATIOS:
        for name, of_world in strokes.items():
            tied = [(likeliest(item.weighing.chances(tempering), ratio), item.stroke.meant) for item in of_world]
            named = [meant in answer for answer, meant in tied if len(answer) == 1]
            some = [meant in answer for answer, meant in tied if 1 < len(answer) <= 3]
            print(
                f"{ratio:9.2f} {name:5s}   {len(named) / len(tied):6.1%} {len(some) / len(tied):6.1%} "
                f"{1 - (len(named) + len(some)) / len(tied):6.1%}   {1 - np.mean(named):6.1%} {1 - np.mean(some):6.1%}"
            )


def print_limits(strokes: dict[str, list[Weighed]], away: Sequence[Weighed], config: FusionConfig) -> None:
    """Shares of strokes beyond the limits, by the number of POIs."""
    print("\nbeyond max_conflict / least_fit, by the number of POIs")
    for name, of_world in (*strokes.items(), ("none meant", away)):
        shares = []
        for number in NUMBERS:
            among = [item.weighing for item in of_world if len(item.stroke.seen) == number]
            conflict = np.mean([item.contour_conflict > config.answer.max_conflict for item in among])
            fit = np.mean([item.fit[np.argmax(item.joint)] < config.answer.least_fit for item in among])
            shares.append(f"{number}: {conflict:.1%} / {fit:.1%}")
        print(f"  {name:10s} {', '.join(shares)}")


def _log_loss(strokes: Sequence[Weighed], chances: Sequence[Values]) -> float:
    return float(np.mean([-np.log(of[item.stroke.meant]) for item, of in zip(strokes, chances, strict=True)]))


def _reliability(strokes: Sequence[Weighed], shares: Sequence[Values]) -> list[tuple[float, float, int]]:
    said = np.array([of.max() for of in shares])
    true = np.array([int(of.argmax()) == item.stroke.meant for item, of in zip(strokes, shares, strict=True)])
    which = np.minimum((said * BINS).astype(int), BINS - 1)
    return [
        (float(said[which == i].mean()), float(true[which == i].mean()), int((which == i).sum()))
        for i in range(BINS)
        if (which == i).any()
    ]


def _calibration_error(strokes: Sequence[Weighed], shares: Sequence[Values]) -> float:
    bins = _reliability(strokes, shares)
    return sum(count * abs(said - true) for said, true, count in bins) / sum(count for *_, count in bins)


if __name__ == "__main__":
    raise SystemExit(main())
