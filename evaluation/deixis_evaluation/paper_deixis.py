"""Our own rules on the trials of the paper's simulation, many at once: what `deixis_fusion.deixis_rules` answers to each.

Readings are few, so their likelihood curves (`deixis_fusion.curves`) are made once each and looked up. A test holds every trial
to the fusion stage's own rules.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from deixis_fusion.config import FusionConfig
from deixis_fusion.curves import BEARINGS, FULL_CIRCLE_DEG, hand_curve, head_curve
from deixis_fusion.deixis_rules import TOLD
from deixis_fusion.evidence import HandObservation, HeadObservation
from deixis_fusion.perceived_yaw import PerceivedYaw
from deixis_fusion.pointing import GESTURES
from deixis_schemas.messages import Side

from .paper_masses import Answers
from .paper_trials import HAND_SIGMA_DEG, Trials

Values = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
HAND_BEARINGS: Values = np.arange(-180.0, 180.0)


class Readings(NamedTuple):
    """Whether our stages tell what the paper's do not: the hand's bearing, and the side of a head that is not computed."""

    hand_bearing: bool
    head_side: bool


PAPERS = Readings(False, False)
OURS = Readings(True, True)


@dataclass(frozen=True, eq=False)
class DeixisModel:
    """Curves (readings, 360) of hand and head. A reading of the hand is its gesture, then gesture and bearing; of the head a
    row of figure 6, the last two being "not computed" to the left and to the right.
    """

    config: FusionConfig
    readings: Readings
    hand: Values
    head: Values

    @staticmethod
    def of(config: FusionConfig, perceived: PerceivedYaw, readings: Readings) -> DeixisModel:
        """`perceived` is figure 6 within the head's range."""
        hands = [HandObservation(gesture) for gesture in GESTURES]
        if readings.hand_bearing:
            hands += [hand_seen(index, bearing) for index in range(len(GESTURES)) for bearing in HAND_BEARINGS]
        heads = [head_seen(row, left, perceived, config, readings) for row, left in _rows(len(perceived.yaw_deg))]
        return DeixisModel(
            config,
            readings,
            np.array([hand_curve(hand, config.hand, config.confusion.hand) for hand in hands]),
            np.array([head_curve(head, config.head) for head in heads]),
        )

    def answers(self, trials: Trials) -> Answers:
        """The answers: none (0) where the rules abstain. Belief is the chance of all POIs answered together."""
        visible, bearings = trials.arrangements.visible, trials.arrangements.bearing_deg
        hands, heads = self._rows_of_hand(trials), trials.yaw + ((trials.yaw == len(self.head) - 2) & ~trials.turned_left)
        hand, head = _at(self.hand, hands, bearings) * visible, _at(self.head, heads, bearings) * visible
        joint, answer = hand * head, self.config.answer
        most = joint.max(axis=1)
        chances = (joint / most[:, None]) ** answer.tempering
        chances /= chances.sum(axis=1, keepdims=True)
        tied = visible & (chances >= answer.tie_ratio * chances.max(axis=1, keepdims=True))
        contour = 1 - most / (hand.max(axis=1) * head.max(axis=1))
        fit = most / (self.hand.max(axis=1)[hands] * self.head.max(axis=1)[heads])
        told = _tells(hand, trials) | _tells(head, trials)
        answered = (contour <= answer.max_conflict) & (fit >= answer.least_fit) & told & (tied.sum(axis=1) <= answer.max_ties)
        sets = np.where(answered, tied @ (1 << np.arange(visible.shape[1])), 0)
        return Answers(np.asarray(sets, dtype=np.int64), (chances * tied).sum(axis=1))

    def _rows_of_hand(self, trials: Trials) -> Indices:
        if not self.readings.hand_bearing:
            return trials.gesture
        shown = trials.gesture != GESTURES.index("invisible")
        of_bearing = len(GESTURES) + trials.gesture * len(HAND_BEARINGS) + (trials.hand_deg - HAND_BEARINGS[0]).astype(np.intp)
        return np.where(shown, of_bearing, trials.gesture)


def hand_seen(gesture: int, bearing_deg: float) -> HandObservation:
    """A hand with a bearing, as the gesture stage tells it from one camera: what lies behind looks like what lies in front."""
    return HandObservation(GESTURES[gesture], bearing_deg, HAND_SIGMA_DEG, mirrored=True)


def head_seen(row: int, left: bool, perceived: PerceivedYaw, config: FusionConfig, readings: Readings) -> HeadObservation:
    """A head read as this row of figure 6, or not computed."""
    if row < len(perceived.yaw_deg):
        return HeadObservation(float(perceived.yaw_deg[row]), yaw_sigma_deg(perceived))
    side: Side = "left" if left else "right"
    return HeadObservation(None, side=side if readings.head_side else None, beyond_deg=config.paper.phi_f_max_deg)


def yaw_sigma_deg(perceived: PerceivedYaw) -> float:
    """By how much figure 6 reads heads aside, root mean square over the range: the sigma that goes with each reading."""
    limit = float(perceived.yaw_deg.max())
    bearings = np.arange(-limit, limit + 1)
    computed = perceived.distributions(bearings)[:-1]
    off = perceived.yaw_deg[:, None] - bearings
    return float(np.sqrt((computed * off**2).sum() / computed.sum()))


def _rows(computed: int) -> list[tuple[int, bool]]:
    return [*((row, True) for row in range(computed)), (computed, True), (computed, False)]


def _at(curves: Values, rows: Indices, bearings_deg: Values) -> Values:
    """`deixis_fusion.curves.at` of one curve for each trial: (t, n)."""
    position = (bearings_deg - BEARINGS[0]) % FULL_CIRCLE_DEG
    below = position.astype(np.intp)
    closed = np.concatenate([curves, curves[:, :2]], axis=1)
    low, high = closed[rows[:, None], below], closed[rows[:, None], below + 1]
    return np.asarray(low + (position - below) * (high - low))


def _tells(likelihoods: Values, trials: Trials) -> npt.NDArray[np.bool_]:
    """Whether a source tells the visible POIs apart; whether a lone one is what was meant, tells how well it fits."""
    visible = trials.arrangements.visible
    least = np.where(visible, likelihoods, np.inf).min(axis=1)
    return np.asarray((visible.sum(axis=1) == 1) | (least < (1 - TOLD) * likelihoods.max(axis=1)))
