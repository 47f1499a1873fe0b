"""How well each POI explains what hand and head showed: the product of likelihoods, over where the person may stand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .config import HandConfig, HeadConfig
from .confusion import HandConfusion
from .curves import BEARINGS, at, hand_curve, head_curve
from .evidence import Evidence, HandObservation, HeadObservation, View
from .sight import Sight

Values = npt.NDArray[np.float64]


class Weighing(NamedTuple):
    """Of each POI in sight (n): the likelihood of the hand, of the head and of both, and how well it fits.

    `hand` and `head` are each on their own the mean over the cases of `sight.py`; `joint` is the mean of their product, for
    hand and head are seen from one place. `fit` is what the POI explains in its best case, beside a POI that hung where it
    explained each best, 0 to 1: not relative to the other POIs, of which none may be what was meant. `head_floor` is the head's
    likelihood where it looks at something else.
    """

    hand: Values
    head: Values
    joint: Values
    fit: Values
    head_floor: float = 0.0

    @property
    def contour_conflict(self) -> float:
        """1 - max_i (L1_i / max L1) (L2_i / max L2): 0 where one POI is the likeliest of both, at any number of POIs.

        The conflict of Dempster's rule says little: .5 with 20 POIs in perfect agreement, .85 in contradiction.
        """
        most = float(self.hand.max() * self.head.max())
        return 1 - float((self.hand * self.head).max()) / most if most > 0 else 1.0

    def chances(self, tempering: float) -> Values:
        """The probability of each POI, all alike beforehand: the joint likelihood to the power of `tempering`, summing to 1."""
        weights = (self.joint / self.joint.max()) ** tempering
        return np.asarray(weights / weights.sum())


def weigh(
    evidence: Evidence,
    seen: Sight,
    hand_config: HandConfig,
    head_config: HeadConfig,
    confusion: HandConfusion | None = None,
) -> Weighing:
    """Weigh all POIs in sight (one at least), by the paper's table 1 or another. A source that says nothing fits each alike.

    The frames of a stroke err alike: what was seen from several places is one observation, and each counts by its share of it
    (a geometric mean), so that a longer stroke is no surer than a short one.
    """
    told, best, floor = np.ones((2, *seen.bearings.cases.shape)), 1.0, 1.0
    for view in evidence.views or (View(evidence.hand, evidence.head),):
        of_hand = _hand(view.hand, view.hand_share, hand_config, confusion)
        curves = np.stack([of_hand, _head(view.head, view.head_share, head_config)])
        bearings = seen.bearings if view.place is None else seen.seen_from(view.place)
        told *= at(curves, bearings.cases)
        best *= float(curves.max(axis=1).prod())
        floor *= float(curves[1].min())
    joint = told[0] * told[1]
    return Weighing(told[0].mean(axis=0), told[1].mean(axis=0), joint.mean(axis=0), joint.max(axis=0) / best, floor)


def shares(weights: Sequence[float]) -> list[float]:
    """The weights, summing to 1; of none, none."""
    total = sum(weights)
    return [weight / total for weight in weights] if total > 0 else list(weights)


def _hand(hand: HandObservation | None, share: float, config: HandConfig, confusion: HandConfusion | None) -> Values:
    if hand is None or share <= 0:
        return np.ones_like(BEARINGS)
    return np.asarray(hand_curve(hand, config, confusion) ** (share * _trust(hand.agreement)))


def _head(head: HeadObservation | None, share: float, config: HeadConfig) -> Values:
    if head is None or share <= 0:
        return np.ones_like(BEARINGS)
    return np.asarray(head_curve(head, config) ** (share * _trust(head.agreement)))


def _trust(agreement: float) -> float:
    """A source counts for less where the frames of a stroke disagree."""
    return 0.5 + 0.5 * min(1.0, max(0.0, agreement))
