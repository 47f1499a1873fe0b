"""Incremental probabilistic classifier of hand blobs (after Pateraki et al. 2011, sec. 4, [3]).

Each frame adds the log likelihoods of what was measured (place relative to the head, size, foreground evidence, speed) to
the belief over left hand, right hand and unknown. Frames in a row say nearly the same thing, so each counts only for a
fraction, and old evidence fades. Left and right are the person's own: the left hand hangs at the image's right of the face.
A hand hanging at its side says much about its side, a raised one little, for arms cross the body: so the label of an arm
that is raised comes from where it was.
"""

from __future__ import annotations

import math
from itertools import permutations
from typing import Literal, NamedTuple

from deixis_schemas.messages import KindProbabilities

HandKind = Literal["left_hand", "right_hand", "unknown"]
KINDS: tuple[HandKind, ...] = ("left_hand", "right_hand", "unknown")

HANGING_BELOW = 2.0  # head widths below the head
RATE_PER_S = 8.0  # independent observations a second
MEMORY = 7.0  # most log odds that are kept
RAISED_SAYS = 2.0  # most log odds that the place of a raised hand gives to its side
SHAPE, MOST_SHAPE = 0.4, 3.0  # share of the finder's log odds that counts, and most of them
RAISED = 1.2  # what is skin-coloured and stands out from the room high up is likelier a hand


class Features(NamedTuple):
    """What is measured of a blob in one frame; lengths in head widths, `dx` and `dy` from the head, image right and down."""

    dx: float
    dy: float
    speed: float
    area: float
    evidence: float  # share of the blob that moved or changed against the background, 0 to 1
    sure: float  # mean P(skin) of the blob, 0 to 1
    right: float = 0.0  # log odds that the finder gives to a right hand there, and to a left one; 0 says nothing
    left: float = 0.0


def _normal(value: float, mean: float, sigma: float) -> float:
    return -0.5 * ((value - mean) / sigma) ** 2 - math.log(sigma)


def _shape(odds: float) -> float:
    return SHAPE * max(-MOST_SHAPE, min(odds, MOST_SHAPE))


def log_likelihoods(f: Features) -> dict[HandKind, float]:
    """Log likelihood of the features for each kind, up to a common constant."""
    mean, sigma = (1.2, 0.8) if f.dy > HANGING_BELOW else (1.3, 1.9)
    size = math.log(max(f.area, 1e-3))
    hand = _normal(size, math.log(0.37), 0.45) + math.log(0.25 + 0.75 * f.evidence) + math.log(0.4 + min(0.6, 0.2 * f.speed))
    other = _normal(size, math.log(0.25), 1.2) + math.log(0.9 - 0.6 * f.evidence) + math.log(0.7 - min(0.5, 0.2 * f.speed))
    # Furniture, trousers and floors that pass for skin do so by a little.
    hand += _normal(f.sure, 0.85, 0.13)
    other += _normal(f.sure, 0.65, 0.2)
    if f.dy < HANGING_BELOW:
        hand += RAISED
    return {
        "left_hand": hand + _normal(f.dx, mean, sigma) + _shape(f.left),
        "right_hand": hand + _normal(f.dx, -mean, sigma) + _shape(f.right),
        "unknown": other + _normal(f.dx, 0.0, 3.0),
    }


class HandBelief:
    """Belief of one track over the kinds."""

    def __init__(self) -> None:
        self._log: dict[HandKind, float] = dict.fromkeys(KINDS, 0.0)

    def update(self, features: Features, dt_s: float) -> None:
        """Add what one frame says; `dt_s` since the last."""
        weight = min(1.0, RATE_PER_S * dt_s)
        likelihoods = log_likelihoods(features)
        if features.dy < HANGING_BELOW:
            likelihoods = self._little_about_the_side(likelihoods)
        for kind, value in likelihoods.items():
            self._log[kind] += weight * value
        top = max(self._log.values())
        self._log = {kind: max(value - top, -MEMORY) for kind, value in self._log.items()}

    def _little_about_the_side(self, likelihoods: dict[HandKind, float]) -> dict[HandKind, float]:
        """Without the sides' difference, once they differ: frame by frame an arm held across the body would change its side."""
        if abs(self._log["left_hand"] - self._log["right_hand"]) < RAISED_SAYS:
            return likelihoods
        either = max(likelihoods["left_hand"], likelihoods["right_hand"])
        return {**likelihoods, "left_hand": either, "right_hand": either}

    def log(self, kind: HandKind) -> float:
        """Log belief in a kind, up to a constant that all kinds of this track share."""
        return self._log[kind]

    def probabilities(self) -> KindProbabilities:
        """Normalised belief."""
        top = max(self._log.values())
        weights = {kind: math.exp(value - top) for kind, value in self._log.items()}
        total = sum(weights.values())
        return KindProbabilities(**{str(kind): weight / total for kind, weight in weights.items()})


def label(beliefs: list[HandBelief], current: list[HandKind]) -> list[HandKind]:
    """Kinds of the tracks of one person, each hand at most once: the assignment of most belief; a change needs a margin."""
    unknown: HandKind = "unknown"
    pool: list[HandKind] = ["left_hand", "right_hand", *([unknown] * len(beliefs))]
    choices: list[tuple[HandKind, ...]] = sorted(set(permutations(pool, len(beliefs))))

    def worth(kinds: tuple[HandKind, ...]) -> float:
        kept = sum(1.5 for new, old in zip(kinds, current, strict=True) if new == old and old != "unknown")
        return kept + sum(belief.log(kind) for belief, kind in zip(beliefs, kinds, strict=True))

    return list(choices[max(range(len(choices)), key=lambda k: worth(choices[k]))])
