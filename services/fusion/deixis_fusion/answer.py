"""Which POIs a combined belief names: one, several when tied, none when it abstains."""

from __future__ import annotations

from dataclasses import dataclass

from .belief import BeliefAssignment, Combination, members
from .config import FusionConfig


@dataclass(frozen=True)
class Choice:
    """The answer as hypotheses (best first); with none of them, `abstains` says why."""

    hypotheses: tuple[int, ...]
    abstains: str = ""


def choose(combination: Combination, config: FusionConfig) -> Choice:
    """The answer by the configured rules."""
    if combination.belief.unknown > config.max_unknown:
        return Choice((), "nothing was observed that tells the POIs apart")
    if config.rules == "paper":
        return Choice(largest_focal_sets(combination.belief))
    if combination.conflict > config.max_conflict:
        return Choice((), f"hand and head contradict each other (conflict {combination.conflict:.2f})")
    tied = best_by_pignistic(combination.belief, config.tie_margin)
    if len(tied) > config.max_ties:
        return Choice((), f"{len(tied)} POIs are equally likely")
    return Choice(tied)


def largest_focal_sets(belief: BeliefAssignment) -> tuple[int, ...]:
    """The paper's choice, "the POI with the larger mass": the union of the sets of largest mass, ascending."""
    most = max(belief.masses.values())
    union = 0
    for subset, mass in belief.masses.items():
        if mass >= most - 1e-9:
            union |= subset
    return tuple(members(union))


def best_by_pignistic(belief: BeliefAssignment, tie_margin: float) -> tuple[int, ...]:
    """The hypotheses whose pignistic probability is within `tie_margin` of the largest, best first."""
    pignistic = belief.pignistic()
    order = sorted(range(belief.size), key=lambda i: (-pignistic[i], i))
    return tuple(i for i in order if pignistic[order[0]] - pignistic[i] < tie_margin or i == order[0])
