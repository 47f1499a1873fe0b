"""Belief assignments as arrays give what belief.py gives."""

from __future__ import annotations

import time

import numpy as np
import pytest
from deixis_fusion import belief
from deixis_fusion.belief import BeliefAssignment
from deixis_fusion.mass_vector import Combined, MassVector, combine
from hypothesis import given
from hypothesis import strategies as st

SIZE = 5


def assignments(size: int = SIZE) -> st.SearchStrategy[BeliefAssignment]:
    weights = st.dictionaries(st.integers(1, (1 << size) - 1), st.floats(1e-3, 1), min_size=1, max_size=8)
    return weights.map(lambda found: belief.normalised(size, found))


def same(ours: MassVector, theirs: BeliefAssignment) -> None:
    assert ours.single == pytest.approx(theirs.singletons(), abs=1e-12)
    assert ours.plausibilities() == pytest.approx(theirs.plausibilities(), abs=1e-12)
    assert ours.pignistic() == pytest.approx(theirs.pignistic(), abs=1e-12)
    assert ours.unknown == pytest.approx(theirs.unknown, abs=1e-12)


@given(assignments())
def test_every_measure_is_that_of_the_exact_assignment(assignment: BeliefAssignment) -> None:
    same(MassVector.of(assignment), assignment)


@given(assignments(), assignments())
def test_dempsters_rule_is_the_exact_one(first: BeliefAssignment, second: BeliefAssignment) -> None:
    exact, ours = belief.combine(first, second), combine(MassVector.of(first), MassVector.of(second))
    same(ours.belief, exact.belief)
    assert ours.conflict == pytest.approx(exact.conflict, abs=1e-12)
    same(Combined.of(exact).belief, exact.belief)


@given(assignments(), st.floats(0, 1))
def test_discounting_is_the_exact_one(assignment: BeliefAssignment, rate: float) -> None:
    same(MassVector.of(assignment).discounted(rate), assignment.discounted(rate))


@given(assignments(1), assignments(1))
def test_of_one_hypothesis_all_is_known_and_nothing(first: BeliefAssignment, second: BeliefAssignment) -> None:
    assert combine(MassVector.of(first), MassVector.of(second)).belief.unknown == 1


def test_total_conflict_is_vacuous_belief() -> None:
    one, other = (MassVector.normalised(np.array(single)) for single in ([1.0, 0.0], [0.0, 1.0]))
    assert combine(one, other).conflict == 1
    assert combine(one, other).belief.unknown == 1


def test_weights_that_are_all_nothing_are_vacuous() -> None:
    assert MassVector.normalised(np.zeros(4)).unknown == 1


@given(assignments())
def test_the_largest_sets_come_first(assignment: BeliefAssignment) -> None:
    told = [focal.mass for focal in MassVector.of(assignment).largest(16)]
    assert told == pytest.approx(sorted((m for m in assignment.masses.values() if m > 0), reverse=True))


def test_a_thousand_hypotheses_are_combined_in_a_millisecond_or_so() -> None:
    rng = np.random.default_rng(1)
    flags = [rng.random(1000) < 0.3 for _ in range(4)]
    one, other = (MassVector.normalised(rng.random(1000), [(f, 9.0) for f in flags]) for _ in range(2))
    started = time.process_time()
    for _ in range(20):
        combine(one, other)
    assert (time.process_time() - started) / 20 < 0.02
