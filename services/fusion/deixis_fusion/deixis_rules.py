"""Our rules, beyond the paper's: every POI is weighed by the likelihood of what was seen given its bearing (`likelihood.py`).

The head turns only part of the way, and part of the mass stays on the sets of eq. 16 and on the whole frame, so that one
wrong source is never a total conflict. Bearings are degrees at the person, positive toward the person's own left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .belief import BeliefAssignment, Combination, as_set, everything_of, normalised, vacuous
from .config import AnswerConfig, HandConfig, HeadConfig
from .decision import Choice
from .evidence import Evidence, HandObservation, HeadObservation
from .likelihood import (
    LEAST_OUT_OF_RANGE,
    contour_conflict,
    fit,
    hand_likelihoods,
    head_likelihoods,
    head_tells_nothing,
    out_of_range_likelihoods,
    yaw_likelihoods,
)
from .paper_rules import gesture_sets
from .visibility import Candidate

POSSIBILITY_LEVELS = 5


@dataclass(frozen=True)
class DeixisRules:
    """Likelihoods of hand and head; the answer is what is likeliest, with ties and abstentions."""

    hand_config: HandConfig
    head_config: HeadConfig
    answer: AnswerConfig

    def hand(self, hand: HandObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 16 refined by the hand's bearing."""
        return hand_assignment(hand, seen, self.hand_config)

    def head(self, head: HeadObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 18 with a head that turns part of the way."""
        return head_assignment(head, seen, self.head_config)

    def contour_conflict(self, evidence: Evidence, seen: Sequence[Candidate]) -> float:
        """How much hand and head contradict each other, 0 to 1; 0 where one of them says nothing."""
        if evidence.hand is None or evidence.head is None:
            return 0.0
        hand = hand_likelihoods(evidence.hand, seen, self.hand_config)
        return contour_conflict(hand, head_likelihoods(evidence.head, seen, self.head_config))

    def choose(self, combination: Combination, evidence: Evidence, seen: Sequence[Candidate]) -> Choice:
        """The POIs of largest pignistic probability, unless hand and head contradict each other or too many are tied."""
        conflict = self.contour_conflict(evidence, seen)
        if conflict > self.answer.max_conflict:
            return Choice((), f"hand and head contradict each other (contour conflict {conflict:.3f})")
        tied = best_by_pignistic(combination.belief, self.answer.tie_margin)
        if len(tied) > self.answer.max_ties:
            return Choice((), f"{len(tied)} POIs are equally likely")
        if len(seen) == 1 and self.fit(evidence, seen[0]) < self.answer.least_fit:
            return Choice((), "the only POI in sight does not lie where hand and head point")
        return Choice(tied)

    def fit(self, evidence: Evidence, candidate: Candidate) -> float:
        """How well a POI explains hand and head, beside others that might hang anywhere: a lone one is never contradicted."""
        hand, head = evidence.hand, evidence.head
        of_hand = fit(lambda seen: hand_likelihoods(hand, seen, self.hand_config), candidate) if hand else 1.0
        return of_hand * (fit(lambda seen: head_likelihoods(head, seen, self.head_config), candidate) if head else 1.0)


def best_by_pignistic(belief: BeliefAssignment, tie_margin: float) -> tuple[int, ...]:
    """The hypotheses whose pignistic probability is within `tie_margin` of the largest, best first."""
    pignistic = belief.pignistic()
    order = sorted(range(belief.size), key=lambda i: (-pignistic[i], i))
    return tuple(i for i in order if pignistic[order[0]] - pignistic[i] < tie_margin or i == order[0])


# --- the hand ---------------------------------------------------------------------------------------------------------


def hand_assignment(hand: HandObservation, seen: Sequence[Candidate], config: HandConfig) -> BeliefAssignment:
    """Eq. 16 refined by the bearing of the hand.

    The sets of eq. 16 keep part of their mass. The rest goes to single POIs by P(gesture | bearing) P(hand's bearing |
    bearing): table 1 with soft borders, times a likelihood with a tail. Without a bearing and with hard borders the single
    masses of a region sum to its mass by eq. 16, so the refinement adds what the bearing tells and nothing else.
    """
    weights = hand_likelihoods(hand, seen, config)
    single = normalised(len(seen), {1 << i: weight for i, weight in enumerate(weights)})
    sets = gesture_sets(hand.gesture, [candidate.bearing_deg for candidate in seen], (config.min_deg, config.max_deg))
    return _mixed(single, sets, config.refinement).discounted(_rate(config.discount, hand.agreement))


# --- the head ---------------------------------------------------------------------------------------------------------


def head_assignment(head: HeadObservation, seen: Sequence[Candidate], config: HeadConfig) -> BeliefAssignment:
    """Eq. 18 with a head that turns only part of the way; beyond its range, mass on the POIs out there.

    Yaws that fit no POI, and yaws that fit a look at the robot, leave their mass on the whole frame: the head then says
    nothing, instead of choosing the least bad POI with full confidence.
    """
    rate = _rate(config.discount, head.agreement)
    if head.yaw_deg is None:
        return _out_of_range(head, seen, config).discounted(rate)
    size, told = len(seen), 1 - config.outlier - config.at_robot
    weights = {1 << i: told / size * value for i, value in enumerate(yaw_likelihoods(head, seen, config))}
    everything = everything_of(size)
    weights[everything] = weights.get(everything, 0.0) + head_tells_nothing(head, config)
    return normalised(size, weights).discounted(rate)


def _out_of_range(head: HeadObservation, seen: Sequence[Candidate], config: HeadConfig) -> BeliefAssignment:
    """Section 6.2: the head is turned beyond its range. Nested sets, the POIs that are surely out there innermost.

    The less likely it is that any POI lies out there, the less is said: where none does, something else was looked at. Cut off
    at a limit instead, a POI one degree farther made the difference between knowing nothing and all.
    """
    possible = out_of_range_likelihoods(head, seen, config)
    most = max(possible)
    if most <= 0:
        return vacuous(len(seen))
    return consonant([value / most for value in possible]).discounted(LEAST_OUT_OF_RANGE / (LEAST_OUT_OF_RANGE + most))


def consonant(possibilities: Sequence[float]) -> BeliefAssignment:
    """The nested assignment whose plausibilities are these possibilities (the largest is 1), in five levels."""
    size = len(possibilities)
    weights: dict[int, float] = {}
    for level in range(POSSIBILITY_LEVELS, 0, -1):
        threshold = (level - 0.5) / POSSIBILITY_LEVELS
        subset = as_set(i for i, value in enumerate(possibilities) if value >= threshold)
        weights[subset] = weights.get(subset, 0.0) + 1 / POSSIBILITY_LEVELS
    return normalised(size, weights)


def _mixed(first: BeliefAssignment, second: BeliefAssignment, share: float) -> BeliefAssignment:
    """`share` of the first, the rest of the second."""
    weights = {subset: share * mass for subset, mass in first.masses.items()}
    for subset, mass in second.masses.items():
        weights[subset] = weights.get(subset, 0.0) + (1 - share) * mass
    return normalised(first.size, weights)


def _rate(discount: float, agreement: float) -> float:
    """Discount of a source: its own, and more where the frames of a stroke disagree."""
    return min(1.0, 1 - (1 - discount) * (0.5 + 0.5 * min(1.0, max(0.0, agreement))))
