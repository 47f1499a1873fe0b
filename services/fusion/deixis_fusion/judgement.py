"""From what was observed of one person to a combined belief and an answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .answer import Choice, choose
from .belief import BeliefAssignment, Combination, combine, vacuous
from .config import FusionConfig
from .discernment import Candidate
from .evidence import (
    HandObservation,
    HeadObservation,
    hand_assignment,
    head_assignment,
    paper_hand_assignment,
    paper_head_assignment,
)


@dataclass(frozen=True)
class Judgement:
    """The assignment of each source, both combined, and the answer."""

    hand: BeliefAssignment
    head: BeliefAssignment
    combination: Combination
    choice: Choice


def judge(
    seen: Sequence[Candidate], hand: HandObservation | None, head: HeadObservation | None, config: FusionConfig
) -> Judgement:
    """Weigh and combine; a source that observed nothing is vacuous. Raises ValueError without candidates."""
    hand_belief = _hand(seen, hand, config)
    head_belief = _head(seen, head, config)
    combination = combine(hand_belief, head_belief)
    return Judgement(hand_belief, head_belief, combination, choose(combination, config))


def _hand(seen: Sequence[Candidate], hand: HandObservation | None, config: FusionConfig) -> BeliefAssignment:
    if hand is None:
        return vacuous(len(seen))
    if config.rules == "paper":
        limits = (config.phi_h_min_deg, config.phi_h_max_deg)
        return paper_hand_assignment(hand.gesture, [candidate.bearing_deg for candidate in seen], limits)
    return hand_assignment(hand, seen, config)


def _head(seen: Sequence[Candidate], head: HeadObservation | None, config: FusionConfig) -> BeliefAssignment:
    if head is None:
        return vacuous(len(seen))
    if config.rules == "paper":
        return paper_head_assignment(head, [candidate.bearing_deg for candidate in seen], config)
    return head_assignment(head, seen, config)
