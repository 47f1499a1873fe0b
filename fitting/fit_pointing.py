"""Fits what tells a pointing hand from others (`deixis_gesture/pointing.npz`), in two steps.

usage: python fitting/fit_pointing.py frames [--seeds A:B] [--check C:D]
       python fitting/fit_pointing.py strokes [--seeds A:B] [--check C:D] [--plain]

frames: single frames, on hands of the simulator's fitting people (`deixis_simulation.held_hands`), cut out as badly as a
tracker does (`hand_outlines.py`). strokes: whole strokes, on what tracker and gesture stage make of the simulator's clips;
after frames, for it weighs what the frames say. Each says how well it does on the hands or clips of --check, by which its
STIFFNESS was chosen, and writes its half of the file. Rendering takes .2 seconds a hand and half a minute a clip on one core,
once.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from additive_model import Floats, Stiffness, fit, log_loss, log_odds_of
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.seeds import parse_seeds
from deixis_gesture.log_odds import LogOdds
from deixis_gesture.pointing_odds import FRAME_KNOTS, STROKE_KNOTS, Knots, Measures, frame_measures
from hand_files import load_hands
from hand_outlines import seen_hand
from numpy.typing import NDArray
from rich.console import Console
from tracked_strokes import SeenStroke, strokes_of

OUT = Path(__file__).resolve().parents[1] / "services/gesture/deixis_gesture/pointing.npz"
TIMES = 4
"""Every hand is cut out so often, each time worse in another way."""
FRAME_STIFFNESS, STROKE_STIFFNESS = Stiffness(0.3, 0.03), Stiffness(0.3, 0.03)
TRIED = (Stiffness(0.3, 0.03), Stiffness(1.0, 0.03), Stiffness(1.0, 0.1), Stiffness(3.0, 0.1), Stiffness(3.0, 0.3))


def main() -> int:
    """Load, fit, check, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step", choices=("frames", "strokes"))
    parser.add_argument("--seeds", help="fit on these (default: 500:550 hands, 0:40 clips)")
    parser.add_argument("--check", help="say how well that does on these (default: 1524:1536 hands, 1000:1012 clips)")
    parser.add_argument("--plain", action="store_true", help="strokes: of plain clips of these seeds, without difficulties")
    given = parser.parse_args()
    if given.step == "frames" and given.plain:
        parser.error("--plain: goes with strokes; hands are cut out of any scenes")
    if given.step == "frames":
        fitted = _frames(given.seeds or "500:550", given.check or "1524:1536")
    else:
        fitted = _strokes(given.seeds or "0:40", given.check or "1000:1012", plain=given.plain)
    _write(given.step[:-1], fitted)
    return 0


def _frames(seeds: str, check: str) -> LogOdds:
    fitting, checking = (_seen_hands(text, seed) for seed, text in enumerate((seeds, check)))
    return _fitted(FRAME_KNOTS, fitting, checking, FRAME_STIFFNESS)


def _strokes(seeds: str, check: str, *, plain: bool) -> LogOdds:
    fitting, checking = (_seen_strokes(text, plain=plain) for text in (seeds, check))
    return _fitted(STROKE_KNOTS, fitting, checking, STROKE_STIFFNESS)


@dataclass(frozen=True)
class Cases:
    """What was measured; (n,) each: whether it points (1, 0), how much it counts, and what it truly is."""

    measured: Sequence[Measures]
    points: Floats
    weights: Floats
    kinds: NDArray[np.str_]


def _seen_hands(seeds: str, seed: int) -> Cases:
    """Pointing hands count half, and all others half."""
    rng, measured, kinds = np.random.default_rng(seed), [], []
    for known in load_hands(parse_seeds(seeds).numbers):
        for _ in range(TIMES):
            hand = seen_hand(known, rng)
            if hand is not None:
                measured.append(frame_measures(hand))
                kinds.append(known.gesture)
    points = np.array([kind == "point" for kind in kinds])
    weights = np.where(points, 0.5 / points.mean(), 0.5 / (1 - points.mean())) / TIMES
    return Cases(measured, points.astype(float), weights, np.array(kinds))


def _seen_strokes(seeds: str, *, plain: bool) -> Cases:
    """Every stroke counts as one, however long it is; hands on their way to a pointing or from it do not count."""
    clips = choose(Choice(None, seeds, plain=plain), Console(stderr=True)).clips
    strokes: dict[int, list[SeenStroke]] = defaultdict(list)
    for seen in strokes_of(clips):
        if seen.doing != "moves":
            strokes[seen.number].append(seen)
    frames = [seen for stroke in strokes.values() for seen in stroke]
    weights = np.array([1 / len(strokes[seen.number]) for seen in frames])
    kinds = [seen.gesture if seen.doing != "points" else "point" for seen in frames]
    points = np.array([float(seen.doing == "points") for seen in frames])
    return Cases([seen.measures for seen in frames], points, weights, np.array(kinds))


def _fitted(knots: Knots, fitting: Cases, checking: Cases, stiffness: Stiffness) -> LogOdds:
    print(f"{len(fitting.measured)} cases to fit on, {len(checking.measured)} to check on")
    for tried in TRIED:
        model = fit(knots, fitting.measured, fitting.points, fitting.weights, tried)
        told = log_odds_of(model, knots, checking.measured)
        loss = log_loss(told, checking.points, checking.weights)
        print(f"{tried}: {loss:.4f} nats a case (nothing known: {_entropy(checking):.4f})")
    model = fit(knots, fitting.measured, fitting.points, fitting.weights, stiffness)
    _say(log_odds_of(model, knots, checking.measured), checking)
    return model


def _entropy(cases: Cases) -> float:
    share = float((cases.points * cases.weights).sum() / cases.weights.sum())
    return -share * float(np.log(share)) - (1 - share) * float(np.log(1 - share))


def _say(told: Floats, cases: Cases) -> None:
    for kind in sorted(set(cases.kinds)):
        own = cases.kinds == kind
        weight = cases.weights[own]
        share = float((weight * (told[own] > 0)).sum() / weight.sum())
        print(f"  {kind}: taken for a pointing in {share:.0%} of {weight.sum():.1f}")
    for low, high in ((0, 0.1), (0.1, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1)):
        probability = 1 / (1 + np.exp(-told))
        own = (probability >= low) & (probability < high + (high == 1))
        if own.any():
            weight, points = cases.weights[own], cases.points[own]
            print(f"  said {low:.0%} to {high:.0%}: {(weight * points).sum() / weight.sum():.0%} of {weight.sum():.1f} point")


def _write(name: str, model: LogOdds) -> None:
    stored: dict[str, Any] = dict(np.load(OUT)) if OUT.exists() else _by_posture_alone()
    own = {f"{name}.{table}": values.values.astype(np.float32) for table, values in model.tables.items()}
    np.savez_compressed(OUT, **{**stored, **own, f"{name}.constant": np.float32(model.constant)})


def _by_posture_alone() -> dict[str, Any]:
    """Strokes as good as their frames, until strokes are fitted."""
    tables = {f"stroke.{name}": np.zeros([len(axis) for axis in axes]) for name, axes in STROKE_KNOTS.items()}
    return {**tables, "stroke.posture": np.array(STROKE_KNOTS["posture"][0]), "stroke.constant": np.array(0.0)}


if __name__ == "__main__":
    raise SystemExit(main())
