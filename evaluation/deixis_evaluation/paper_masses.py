"""The paper's masses and decision for many trials at once: what `deixis_fusion.paper_rules` and `combination` give for each.

Sets of POIs are bit masks and masses are dense, a column for each of the 2^n sets: n is 8 at most. A test holds every trial to
the fusion stage's own rules.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from deixis_fusion.belief import TOTAL_CONFLICT
from deixis_fusion.combination import RuleName
from deixis_fusion.config import FusionConfig
from deixis_fusion.paper_rules import SAME_MASS
from deixis_fusion.perceived_yaw import PerceivedYaw
from deixis_fusion.pointing import REGIONS

from .paper_trials import Trials, hand_shares, regions

Values = npt.NDArray[np.float64]
Sets = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]


class Focals(NamedTuple):
    """Focal sets of t assignments, f of each: `sets` (t, f), bit masks, and `masses` (t, f); 0 where there is none."""

    sets: Sets
    masses: Values

    @staticmethod
    def normalised(sets: Sets, weights: Values, everything: Sets) -> Focals:
        """Proportional to these weights; vacuous where they are all 0."""
        weights = np.where(sets > 0, weights, 0.0)
        total = weights.sum(axis=1, keepdims=True)
        told = total > 0
        sets, weights = sets.copy(), np.where(told, weights / np.where(told, total, 1.0), 0.0)
        sets[~told[:, 0], 0] = everything[~told[:, 0]]
        weights[~told[:, 0], 0] = 1.0
        return Focals(sets, weights)


class Answers(NamedTuple):
    """What was answered in t trials: the POIs as bit masks (t), and the belief in that answer (t)."""

    sets: Sets
    belief: Values


class Pair(NamedTuple):
    """A focal set of the hand with one of the head, in each trial (t): sets, masses, and product of the masses."""

    hand: Sets
    head: Sets
    hand_mass: Values
    head_mass: Values

    @property
    def product(self) -> Values:
        """Of the masses."""
        return np.asarray(self.hand_mass * self.head_mass)


class Sources(NamedTuple):
    """Hand and head of t trials, and all POIs that are visible (t)."""

    hand: Focals
    head: Focals
    everything: Sets
    pois: int

    def discounted(self, hand_rate: float, head_rate: float) -> Sources:
        """Shafer's discounting of each: that part of the mass goes to all POIs."""
        both = ((self.hand, hand_rate), (self.head, head_rate))
        hand, head = (
            Focals(
                np.concatenate([focals.sets, self.everything[:, None]], axis=1),
                np.concatenate([focals.masses * (1 - rate), np.full((len(focals.sets), 1), rate)], axis=1),
            )
            for focals, rate in both
        )
        return Sources(hand, head, self.everything, self.pois)

    @property
    def pairs(self) -> list[Pair]:
        """Each focal set of the hand with each of the head."""
        (hands, hand_masses), (heads, head_masses) = self.hand, self.head
        return [
            Pair(hands[:, i], heads[:, k], hand_masses[:, i], head_masses[:, k])
            for i in range(hands.shape[1])
            for k in range(heads.shape[1])
        ]


def sources(trials: Trials, perceived: PerceivedYaw, config: FusionConfig) -> Sources:
    """The assignments of hand (eq. 16) and head (eq. 18). `perceived` is figure 6 within the head's range."""
    bearings, visible = trials.arrangements.bearing_deg, trials.arrangements.visible
    bits = 1 << np.arange(visible.shape[1])
    everything = np.asarray(visible @ bits, dtype=np.int64)
    hand = _hand(trials, config, bits, everything)
    likelihoods = np.where(visible, _likelihoods(trials, perceived), 0.0)
    far = (np.abs(bearings) > config.paper.phi_f_max_deg) & visible
    sets = np.concatenate([np.where(visible & ~far, bits, 0), (far @ bits)[:, None]], axis=1)
    weights = np.concatenate([likelihoods, (likelihoods * far).sum(axis=1, keepdims=True)], axis=1)
    return Sources(hand, Focals.normalised(sets, weights, everything), everything, len(bits))


def likelihoods_of(perceived: PerceivedYaw, yaw: npt.NDArray[np.intp], bearings_deg: Values) -> Values:
    """P(the reading of each trial (t) | each bearing (t, n))."""
    told = perceived.distributions(bearings_deg)
    return np.asarray(np.take_along_axis(told, yaw[None, :, None], axis=0)[0])


def largest(masses: Values) -> Sets:
    """The paper's choice, of dense masses (t, 2^n): the union of the sets of largest mass, as `largest_focal_sets` has it."""
    most = masses.max(axis=1) - SAME_MASS
    union = np.zeros(len(masses), dtype=np.int64)
    for subset in range(1, masses.shape[1]):
        union |= np.where(masses[:, subset] >= most, subset, 0)
    return union


def largest_focals(focals: Focals) -> Sets:
    """The same of one source, whose focal sets are all different."""
    chosen = (focals.masses >= focals.masses.max(axis=1, keepdims=True) - SAME_MASS) & (focals.masses > 0)
    return np.asarray(np.bitwise_or.reduce(np.where(chosen, focals.sets, 0), axis=1))


def belief_in(masses: Values, sets: Sets) -> Values:
    """Bel of a set in each trial."""
    total = np.zeros(len(masses))
    for subset in range(1, masses.shape[1]):
        total += np.where(subset & ~sets == 0, masses[:, subset], 0.0)
    return total


def answers(masses: Values) -> Answers:
    """The paper's choice, and the belief in it."""
    sets = largest(masses)
    return Answers(sets, belief_in(masses, sets))


# --- the rules of combination, of two sources --------------------------------------------------------------------------


def dempster(both: Sources) -> Values:
    """Dense masses (t, 2^n) by Dempster's rule; vacuous with total conflict."""
    joint = _dense(both)
    for pair in both.pairs:
        _add(joint, pair.hand & pair.head, pair.product)
    joint[:, 0] = 0.0
    agreement = joint.sum(axis=1)
    total = agreement < TOTAL_CONFLICT
    joint /= np.where(total, 1.0, agreement)[:, None]
    joint[total] = 0.0
    joint[total, both.everything[total]] = 1.0
    return joint


def yager(both: Sources) -> Values:
    """Conflict to the whole frame."""
    joint = _dense(both)
    for pair in both.pairs:
        met = pair.hand & pair.head
        _add(joint, np.where(met > 0, met, both.everything), pair.product)
    return joint


def dubois_prade(both: Sources) -> Values:
    """A conflicting product to the union of its sets."""
    joint = _dense(both)
    for pair in both.pairs:
        met = pair.hand & pair.head
        _add(joint, np.where(met > 0, met, pair.hand | pair.head), pair.product)
    return joint


def pcr6(both: Sources) -> Values:
    """A conflicting product back to its sets, in proportion to their masses."""
    joint = _dense(both)
    for pair in both.pairs:
        met, product = pair.hand & pair.head, pair.product
        conflict = np.where(met == 0, product / np.maximum(pair.hand_mass + pair.head_mass, TOTAL_CONFLICT), 0.0)
        _add(joint, met, np.where(met > 0, product, 0.0))
        _add(joint, pair.hand, conflict * pair.hand_mass)
        _add(joint, pair.head, conflict * pair.head_mass)
    return joint


RULES: Mapping[RuleName, Callable[[Sources], Values]] = {
    "dempster": dempster,
    "yager": yager,
    "dubois_prade": dubois_prade,
    "pcr6": pcr6,
}


def conflict(both: Sources) -> Values:
    """1 - K (t): the mass of the pairs that do not meet."""
    return np.asarray(sum(np.where(pair.hand & pair.head == 0, pair.product, 0.0) for pair in both.pairs))


def _hand(trials: Trials, config: FusionConfig, bits: npt.NDArray[np.intp], everything: Sets) -> Focals:
    visible, of_poi = trials.arrangements.visible, regions(trials.arrangements.bearing_deg, config)
    share = hand_shares(config)[trials.gesture]
    sets, weights = [], []
    for index in range(len(REGIONS)):
        inside = visible & (of_poi == index)
        sets.append(inside @ bits)
        weights.append(share[:, index] * inside.sum(axis=1) / visible.sum(axis=1))
    return Focals.normalised(np.stack(sets, axis=1), np.stack(weights, axis=1), everything)


def _likelihoods(trials: Trials, perceived: PerceivedYaw) -> Values:
    return likelihoods_of(perceived, trials.yaw, trials.arrangements.bearing_deg)


def _dense(both: Sources) -> Values:
    return np.zeros((len(both.everything), 1 << both.pois))


def _add(masses: Values, sets: Sets, amounts: Values) -> None:
    """Each trial's amount to its set; a set occurs once in a trial, so nothing is lost."""
    masses[np.arange(len(sets)), sets] += amounts
