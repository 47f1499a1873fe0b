"""Deciding: the masses of hand and head by the rules, combined by Dempster's rule (eqs 11-15), and the answer chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from .belief import BeliefAssignment, Combination, combine, vacuous
from .evidence import Evidence, HandObservation, HeadObservation
from .visibility import Candidate


@dataclass(frozen=True)
class Choice:
    """The answer as hypotheses (best first); with none of them, `abstains` says why."""

    hypotheses: tuple[int, ...]
    abstains: str = ""


class Rules(Protocol):
    """How observations become basic belief assignments over the POIs seen, and a combined belief an answer."""

    def hand(self, hand: HandObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """The assignment of a pointing hand; `seen` is not empty."""
        ...

    def head(self, head: HeadObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """The assignment of a head; `seen` is not empty."""
        ...

    def contour_conflict(self, evidence: Evidence, seen: Sequence[Candidate]) -> float:
        """How much hand and head contradict each other, 0 to 1; `seen` is not empty."""
        ...

    def choose(self, combination: Combination, evidence: Evidence, seen: Sequence[Candidate]) -> Choice:
        """The answer to a belief that tells the POIs apart, or that is about a single one."""
        ...


@dataclass(frozen=True)
class Judgement:
    """The POIs in question, the assignment of each source, both combined, and the answer."""

    seen: Sequence[Candidate]
    hand: BeliefAssignment
    head: BeliefAssignment
    combination: Combination
    choice: Choice
    contour_conflict: float = 0.0

    @cached_property
    def pignistic(self) -> list[float]:
        """Pignistic probability of each POI."""
        return self.combination.belief.pignistic()

    @property
    def poi_ids(self) -> tuple[str, ...]:
        """The answer, best first."""
        return tuple(self.seen[i].poi.poi_id for i in self.choice.hypotheses)


def decide(seen: Sequence[Candidate], evidence: Evidence, rules: Rules, max_unknown: float) -> Judgement:
    """Weigh and combine; a source that observed nothing is vacuous. With more than `max_unknown` on the whole frame, abstain.

    Of a single POI the whole frame is all there is: there it counts whether anything was observed.
    Raises ValueError where no POI is seen.
    """
    size = len(seen)
    hand = rules.hand(evidence.hand, seen) if evidence.hand is not None else vacuous(size)
    head = rules.head(evidence.head, seen) if evidence.head is not None else vacuous(size)
    combination = combine(hand, head)
    silent = evidence.hand is None and evidence.head is None
    if silent or (size > 1 and combination.belief.unknown > max_unknown):
        choice = Choice((), "nothing was observed that tells the POIs apart")
    else:
        choice = rules.choose(combination, evidence, seen)
    return Judgement(seen, hand, head, combination, choice, rules.contour_conflict(evidence, seen))
