"""Figures of fusion over clips: what `deixis eval --stage fusion` prints and writes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .fusion_play import GAPS_DEG, VARIANTS, FusionScore, GapAnswer, Variant
from .proportion import Proportion

BINS = 10
CAUSES = ("head", "hand", "either", "both together", "neither")
DEFINITION = (
    "Named, in a set, missed, wrong: of the strokes, on what the stages said, and on the truth in place of head, of hand "
    "(strokes, side and bearing), of both. Not named: by the source whose truth alone would have named it; either; both only "
    "together; neither. Rings: named among POIs every so many degrees around the person, as far and as high as the one meant. "
    "ECE: stated chance of the likeliest POI of these answers against how often it is the one meant, in ten bins. Few answers "
    "have an ECE far from 0 by the luck of the draw: beside it what it is where every stated chance is true, of the same "
    "answers (2000 draws, those of a stroke all by one number, for they go by the same evidence), mean and 95th percentile."
)
DRAWS = 2000
SEED = 1


@dataclass(frozen=True)
class Bin:
    """Answers whose likeliest POI had a chance within a tenth: mean of it, and how many were right."""

    stated: float
    right: Proportion


def played(scores: Sequence[FusionScore]) -> list[FusionScore]:
    """Those that did not fail."""
    return [score for score in scores if score.failure is None]


def outcomes(scores: Sequence[FusionScore], variant: Variant) -> Counter[str]:
    """How many strokes were named, in a set, missed and wrong."""
    return Counter(episode.outcome for score in played(scores) for episode in score.strokes[variant])


def faults(scores: Sequence[FusionScore]) -> Counter[str]:
    """Strokes that are not named, by whose truth would have named them."""
    found: Counter[str] = Counter()
    for score in played(scores):
        for rows in zip(*(score.strokes[variant] for variant in VARIANTS), strict=True):
            own, head, hand, both = (row.outcome == "named" for row in rows)
            if not own:
                found[_cause(head, hand, both)] += 1
    return found


def _cause(head: bool, hand: bool, both: bool) -> str:
    if head and hand:
        return "either"
    if head or hand:
        return "head" if head else "hand"
    return "both together" if both else "neither"


def named_at(scores: Sequence[FusionScore], gap_deg: int) -> Proportion:
    """Of all strokes."""
    return Proportion.of(answer.outcome == "named" for answer in _gaps(scores) if answer.gap_deg == gap_deg)


def reliability(scores: Sequence[FusionScore], by_masses: bool = False) -> list[Bin]:
    """By stated chance, or by the masses' pignistic probability, the lowest first; empty bins left out."""
    answers = _gaps(scores)
    told = [(answer.chance, answer.is_meant) for answer in answers if answer.chance is not None]
    if by_masses:
        told = [answer.by_masses for answer in answers if answer.by_masses is not None]
    bins = []
    for number in range(BINS):
        own = [(chance, right) for chance, right in told if min(int(chance * BINS), BINS - 1) == number]
        if own:
            bins.append(Bin(sum(chance for chance, _ in own) / len(own), Proportion.of(right for _, right in own)))
    return bins


def calibration_error(bins: Sequence[Bin]) -> float | None:
    """Mean difference of stated and true, by how many answers a bin has; none without answers."""
    total = sum(one.right.total for one in bins)
    return sum(one.right.total * abs(one.stated - (one.right.share or 0.0)) for one in bins) / total if total else None


class Luck(NamedTuple):
    """The ECE of as many answers, of which every stated chance is true: mean and 95th percentile over the draws."""

    mean: float
    most: float


def luck(scores: Sequence[FusionScore]) -> Luck | None:
    """Of the answers that there are; none without answers. Always the same draws."""
    strokes = [(score.name, answer.stroke) for score in played(scores) for answer in score.gaps if answer.chance is not None]
    if not strokes:
        return None
    stated = np.array([answer.chance for answer in _gaps(scores) if answer.chance is not None])
    stroke = np.unique([f"{name} {number}" for name, number in strokes], return_inverse=True)[1]
    drawn = np.random.default_rng(SEED).random((DRAWS, int(stroke.max()) + 1))[:, stroke]
    bins = np.minimum((stated * BINS).astype(np.intp), BINS - 1) == np.arange(BINS)[:, None]
    off = np.abs(((drawn < stated) - stated) @ bins.T).sum(axis=1) / len(stated)
    return Luck(float(off.mean()), float(np.quantile(off, 0.95)))


def figures(scores: Sequence[FusionScore]) -> dict[str, Any]:
    """What the JSON file says of all clips."""
    bins, of_masses, by_luck = reliability(scores), reliability(scores, by_masses=True), luck(scores)
    return {
        "clips": len(scores),
        "outcomes": {variant: dict(outcomes(scores, variant)) for variant in VARIANTS},
        "false_episodes": {variant: sum(score.false[variant] for score in played(scores)) for variant in VARIANTS},
        "at_fault": {cause: faults(scores)[cause] for cause in CAUSES},
        "named_at_gap": {
            str(gap): {"share": named_at(scores, gap).share, "of": named_at(scores, gap).total} for gap in GAPS_DEG
        },
        "reliability": _rows(bins),
        "ece": calibration_error(bins),
        "ece_if_chances_are_true": by_luck and {"mean": by_luck.mean, "percentile_95": by_luck.most},
        "reliability_of_masses": _rows(of_masses),
        "ece_of_masses": calibration_error(of_masses),
    }


def _rows(bins: Sequence[Bin]) -> list[dict[str, Any]]:
    return [{"stated": one.stated, "right": one.right.share, "answers": one.right.total} for one in bins]


def _gaps(scores: Sequence[FusionScore]) -> list[GapAnswer]:
    return [answer for score in played(scores) for answer in score.gaps]
