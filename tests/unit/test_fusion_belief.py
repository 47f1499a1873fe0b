"""Laws of basic belief assignments and of Dempster's rule (eqs 11-15)."""

from __future__ import annotations

import math

import pytest
from deixis_fusion.belief import (
    BeliefAssignment,
    as_set,
    combine,
    everything_of,
    members,
    normalised,
    vacuous,
)
from hypothesis import given, settings
from hypothesis import strategies as st

SIZE = 5


@st.composite
def assignments(draw: st.DrawFn, size: int = SIZE) -> BeliefAssignment:
    subsets = draw(st.lists(st.integers(1, everything_of(size)), min_size=1, max_size=8, unique=True))
    weights = draw(st.lists(st.floats(0.01, 1), min_size=len(subsets), max_size=len(subsets)))
    # Some mass on X: with total conflict the rule is not associative, and that case has tests of its own.
    weighted = dict(zip(subsets, weights, strict=True))
    weighted[everything_of(size)] = weighted.get(everything_of(size), 0.0) + 0.05
    return normalised(size, weighted)


def close(a: BeliefAssignment, b: BeliefAssignment, tolerance: float = 1e-9) -> bool:
    subsets = set(a.masses) | set(b.masses)
    return all(abs(a.masses.get(s, 0.0) - b.masses.get(s, 0.0)) < tolerance for s in subsets)


@given(assignments(), assignments())
def test_masses_sum_to_one_and_the_empty_set_has_none(a: BeliefAssignment, b: BeliefAssignment) -> None:
    combined = combine(a, b).belief
    assert math.isclose(math.fsum(combined.masses.values()), 1.0, abs_tol=1e-9)
    assert 0 not in combined.masses


@given(assignments(), assignments())
def test_combination_is_commutative(a: BeliefAssignment, b: BeliefAssignment) -> None:
    one, other = combine(a, b), combine(b, a)
    assert close(one.belief, other.belief)
    assert math.isclose(one.conflict, other.conflict, abs_tol=1e-12)


@given(assignments(), assignments(), assignments())
def test_combination_is_associative_and_so_is_its_conflict(
    a: BeliefAssignment, b: BeliefAssignment, c: BeliefAssignment
) -> None:
    left, right = combine(combine(a, b).belief, c), combine(a, combine(b, c).belief)
    assert close(left.belief, right.belief, 1e-7)


@given(assignments())
def test_the_vacuous_assignment_is_neutral(a: BeliefAssignment) -> None:
    combined = combine(a, vacuous(SIZE))
    assert close(combined.belief, a)
    assert combined.conflict == pytest.approx(0.0, abs=1e-12)


@given(assignments())
def test_belief_is_at_most_pignistic_is_at_most_plausibility(a: BeliefAssignment) -> None:
    rows = zip(a.singletons(), a.pignistic(), a.plausibilities(), strict=True)
    assert all(bel <= bet + 1e-12 and bet <= pl + 1e-12 for bel, bet, pl in rows)
    assert math.isclose(math.fsum(a.pignistic()), 1.0, abs_tol=1e-9)


@given(assignments(), st.integers(1, everything_of(SIZE) - 1))
def test_plausibility_is_one_minus_the_belief_in_the_complement(a: BeliefAssignment, subset: int) -> None:
    assert math.isclose(a.plausibility(subset), 1 - a.belief(everything_of(SIZE) & ~subset), abs_tol=1e-9)


@given(assignments(), st.floats(0, 1))
def test_discounting_never_makes_a_belief_more_certain(a: BeliefAssignment, rate: float) -> None:
    discounted = a.discounted(rate)
    assert discounted.unknown >= a.unknown - 1e-12
    assert all(new <= old + 1e-12 for new, old in zip(discounted.singletons(), a.singletons(), strict=True))


@given(assignments(), assignments())
def test_shortcut_for_singletons_gives_the_plain_sum_of_equation_14(a: BeliefAssignment, b: BeliefAssignment) -> None:
    plain: dict[int, float] = {}
    for one, mass in a.masses.items():
        for other, other_mass in b.masses.items():
            if one & other:
                plain[one & other] = plain.get(one & other, 0.0) + mass * other_mass
    agreement = math.fsum(plain.values())
    combined = combine(a, b)
    assert combined.conflict == pytest.approx(1 - agreement, abs=1e-9)
    assert close(combined.belief, normalised(SIZE, plain))


def zadeh() -> tuple[BeliefAssignment, BeliefAssignment]:
    """Meningitis, tumour, contusion."""
    return BeliefAssignment(3, {0b001: 0.99, 0b010: 0.01}), BeliefAssignment(3, {0b100: 0.99, 0b010: 0.01})


def test_zadehs_case_is_certain_of_the_tumour_with_nearly_total_conflict() -> None:
    combined = combine(*zadeh())
    assert combined.conflict == pytest.approx(0.9999)
    assert combined.belief.masses == {0b010: pytest.approx(1.0)}


def test_zadehs_case_discounted_by_a_tenth_gives_the_published_masses() -> None:
    first, second = zadeh()
    belief = combine(first.discounted(0.1), second.discounted(0.1)).belief
    assert belief.singletons() == pytest.approx([0.46875, 0.00990, 0.46875], abs=1e-5)
    assert belief.unknown == pytest.approx(0.05261, abs=1e-5)


def test_total_conflict_is_vacuous_and_flagged_never_nan() -> None:
    combined = combine(BeliefAssignment(2, {0b01: 1.0}), BeliefAssignment(2, {0b10: 1.0}))
    assert combined.conflict == 1.0
    assert combined.belief.unknown == 1.0


@given(st.sets(st.integers(0, 40)))
def test_a_set_as_a_bit_mask_keeps_its_members(hypotheses: set[int]) -> None:
    assert list(members(as_set(hypotheses))) == sorted(hypotheses)


@pytest.mark.parametrize(
    ("masses", "complaint"),
    [({0: 0.5, 1: 0.5}, "non-empty set"), ({4: 1.0}, "of 2 hypotheses"), ({1: 0.4}, "sum to"), ({1: math.nan}, "not within")],
)
def test_masses_that_break_the_definition_are_refused(masses: dict[int, float], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        BeliefAssignment(2, masses)


@settings(max_examples=20)
@given(st.integers(1, 60))
def test_many_pois_cost_no_time_and_stay_normalised(n: int) -> None:
    size = n * 17
    single = normalised(size, {1 << i: 1.0 + i for i in range(size)}).discounted(0.1)
    combined = combine(single, single).belief
    assert math.isclose(math.fsum(combined.masses.values()), 1.0, abs_tol=1e-9)
