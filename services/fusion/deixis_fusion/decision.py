"""Deciding: what the rules make of hand and head, and the answer chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from .belief import BeliefAssignment, Combination, combine, vacuous
from .evidence import Evidence, HandObservation, HeadObservation
from .mass_vector import Combined, MassVector
from .sight import ids_at
from .visibility import Candidate

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Choice:
    """The answer as hypotheses (best first); with none of them, `abstains` says why."""

    hypotheses: tuple[int, ...]
    abstains: str = ""


@dataclass(frozen=True, eq=False)
class Judgement:
    """The POIs in question, the assignment of each source, both combined, and the answer.

    `chances` is the probability of each POI, by which they are ranked.
    """

    seen: Sequence[Candidate]
    hand: MassVector
    head: MassVector
    combination: Combined
    chances: Values
    choice: Choice
    contour_conflict: float = 0.0
    credible_share: float = 0.9

    @cached_property
    def order(self) -> npt.NDArray[np.intp]:
        """The hypotheses, the likeliest first."""
        return (-self.chances).argsort(kind="stable")

    @cached_property
    def credible(self) -> tuple[int, ...]:
        """The fewest hypotheses, best first, among which the POI meant is with a probability of `credible_share`."""
        needed = int(self.chances[self.order].cumsum().searchsorted(self.credible_share * (1 - 1e-12))) + 1
        return tuple(self.order[:needed].tolist())

    @cached_property
    def pignistic(self) -> Values:
        """Pignistic probability of each POI, by the masses."""
        return self.combination.belief.pignistic()

    @cached_property
    def plausibilities(self) -> Values:
        """Plausibility of each POI, by the masses."""
        return self.combination.belief.plausibilities()

    @property
    def poi_ids(self) -> tuple[str, ...]:
        """The answer, best first."""
        return tuple(ids_at(self.seen, self.choice.hypotheses))


class Rules(Protocol):
    """How observations become an answer."""

    def judge(self, seen: Sequence[Candidate], evidence: Evidence) -> Judgement:
        """What to think of the POIs that are seen (one at least)."""
        ...


class MassRules(Protocol):
    """Rules that answer by the combined masses alone."""

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
        """The answer to the combined belief, where anything was observed."""
        ...


@dataclass(frozen=True)
class ByMasses:
    """Rules by masses, with what all share: a source that observed nothing is vacuous, and chances are pignistic."""

    rules: MassRules
    credible: float

    def judge(self, seen: Sequence[Candidate], evidence: Evidence) -> Judgement:
        """Weigh and combine."""
        return decide(seen, evidence, self.rules, self.credible)


def decide(seen: Sequence[Candidate], evidence: Evidence, rules: MassRules, credible: float = 0.9) -> Judgement:
    """Weigh and combine; a source that observed nothing is vacuous. Where neither did, there is no question to answer.

    Raises ValueError where no POI is seen.
    """
    size = len(seen)
    hand = rules.hand(evidence.hand, seen) if evidence.hand is not None else vacuous(size)
    head = rules.head(evidence.head, seen) if evidence.head is not None else vacuous(size)
    combination = combine(hand, head)
    if evidence.hand is None and evidence.head is None:
        choice = Choice((), "nothing was observed that tells the POIs apart")
    else:
        choice = rules.choose(combination, evidence, seen)
    chances = np.array(combination.belief.pignistic())
    return Judgement(
        seen=seen,
        hand=MassVector.of(hand),
        head=MassVector.of(head),
        combination=Combined.of(combination),
        chances=chances,
        choice=choice,
        contour_conflict=rules.contour_conflict(evidence, seen),
        credible_share=credible,
    )
