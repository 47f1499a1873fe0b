"""How well each POI explains what hand and head showed: the product of likelihoods, over where the person may stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .config import HandConfig, HeadConfig
from .curves import Curve, at, hand_curve, head_curve
from .evidence import Evidence, View
from .localisation import PersonPlace
from .sight import Sight

Values = npt.NDArray[np.float64]

# POIs at a time: what is reckoned on the way then stays in the processor's cache.
AT_A_TIME = 1024


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


def weigh(evidence: Evidence, seen: Sight, hand_config: HandConfig, head_config: HeadConfig) -> Weighing:
    """Weigh all POIs in sight (one at least); a source that says nothing is as likely with each.

    The frames of a stroke err alike: what was seen from several places is one observation, and each counts by its share of it
    (a geometric mean), so that a longer stroke is no surer than a short one.
    """
    told = [_Told.of(view, hand_config, head_config) for view in evidence.views or (View(evidence.hand, evidence.head),)]
    best = math.prod(float(curve.max()) for view in told for curve in view.curves)
    floor = math.prod(float(view.head.min()) for view in told if view.head is not None)
    parts = [_part(told, seen, slice(start, start + AT_A_TIME)) for start in range(0, len(seen), AT_A_TIME)]
    hand, head, joint, most = np.concatenate(parts, axis=1) if len(parts) > 1 else parts[0]
    return Weighing(hand, head, joint, most / best, floor)


class _Told(NamedTuple):
    """What hand and head tell in one view, none where nothing."""

    hand: Curve | None
    head: Curve | None
    place: PersonPlace | None

    @staticmethod
    def of(view: View, hand_config: HandConfig, head_config: HeadConfig) -> _Told:
        """The curves of the view, each to the power of its part."""
        return _Told(_hand(view, hand_config), _head(view, head_config), view.place)

    @property
    def curves(self) -> list[Curve]:
        """Those that there are."""
        return [curve for curve in (self.hand, self.head) if curve is not None]


def _part(told: Sequence[_Told], seen: Sight, part: slice) -> Values:
    """Of this part of the POIs: the likelihoods of hand, head and both, and of both in the best case (4, n)."""
    shape = seen.bearings.cases[:, part].shape
    hand = head = np.ones(1, dtype=np.float32)
    for view in told:
        if not view.curves:
            continue
        cases = seen.bearings.cases[:, part] if view.place is None else seen.seen_from(view.place, part)
        values = list(at(np.stack(view.curves), cases))
        if view.head is not None:
            head = values.pop() * head
        if view.hand is not None:
            hand = values.pop() * hand
    joint = np.broadcast_to(hand * head, shape)
    means = [np.broadcast_to(likelihoods, shape).mean(axis=0) for likelihoods in (hand, head, joint)]
    return np.array([*means, joint.max(axis=0)], dtype=np.float64)


def _hand(view: View, config: HandConfig) -> Curve | None:
    """What the hand tells in one view, to the power of its part; none where it tells nothing."""
    if view.hand is None or view.hand_share <= 0:
        return None
    return np.asarray(hand_curve(view.hand, config) ** (view.hand_share * _trust(view.hand.agreement)))


def _head(view: View, config: HeadConfig) -> Curve | None:
    """What the head tells in one view, to the power of its part; none where it tells nothing."""
    if view.head is None or view.head_share <= 0:
        return None
    return np.asarray(head_curve(view.head, config) ** (view.head_share * _trust(view.head.agreement)))


def _trust(agreement: float) -> float:
    """A source counts for less where the frames of a stroke disagree."""
    return 0.5 + 0.5 * min(1.0, max(0.0, agreement))
