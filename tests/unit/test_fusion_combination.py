"""Laws of the rules that combine sources, Zadeh's case exactly, and agreement with two public libraries."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from deixis_fusion.belief import BeliefAssignment, everything_of, normalised, vacuous
from deixis_fusion.combination import RULES, Rule, dempster, dubois_prade, pcr6, yager
from hypothesis import assume, given, settings
from hypothesis import strategies as st

SIZE = 4
EVERYTHING = everything_of(SIZE)
by_rule = pytest.mark.parametrize("rule", RULES.values(), ids=RULES.keys())


@st.composite
def assignments(draw: st.DrawFn) -> BeliefAssignment:
    """Any; with or without mass on X, so that conflict may be total."""
    weights = draw(st.dictionaries(st.integers(1, EVERYTHING), st.floats(0.01, 1), min_size=1, max_size=5))
    return normalised(SIZE, weights)


several = st.lists(assignments(), min_size=1, max_size=4)


def mass_gap(a: BeliefAssignment, b: BeliefAssignment) -> float:
    return max(abs(a.masses.get(s, 0.0) - b.masses.get(s, 0.0)) for s in set(a.masses) | set(b.masses))


@by_rule
@given(sources=several)
def test_masses_sum_to_one_the_empty_set_has_none_and_conflict_is_a_share(rule: Rule, sources: list[BeliefAssignment]) -> None:
    combined = rule(sources)
    assert math.fsum(combined.belief.masses.values()) == pytest.approx(1.0, abs=1e-12)
    assert 0 not in combined.belief.masses
    assert 0.0 <= combined.conflict <= 1.0


@by_rule
@given(sources=several, data=st.data())
def test_the_order_of_the_sources_does_not_matter(rule: Rule, sources: list[BeliefAssignment], data: st.DataObject) -> None:
    one, other = rule(sources), rule(data.draw(st.permutations(sources)))
    assert mass_gap(one.belief, other.belief) < 1e-9
    assert one.conflict == pytest.approx(other.conflict, abs=1e-9)


@by_rule
@given(source=assignments())
def test_one_source_is_itself(rule: Rule, source: BeliefAssignment) -> None:
    assert mass_gap(rule([source]).belief, source) < 1e-12
    assert rule([source]).conflict == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("rule", [dempster, yager], ids=["dempster", "yager"])
@given(sources=several)
def test_a_vacuous_source_is_neutral(rule: Rule, sources: list[BeliefAssignment]) -> None:
    assert mass_gap(rule([*sources, vacuous(SIZE)]).belief, rule(sources).belief) < 1e-9


@by_rule
@given(source=assignments())
def test_a_vacuous_source_beside_one_other_is_neutral(rule: Rule, source: BeliefAssignment) -> None:
    assert mass_gap(rule([source, vacuous(SIZE)]).belief, source) < 1e-12


def test_a_vacuous_source_takes_its_part_of_a_conflict_by_pcr6_and_by_dubois_and_prade() -> None:
    # Each product m1 m2 m3 of {0}, {1}, X goes back as 1 : 1 : 1; and to the union, which is X with 3 hypotheses.
    opposed = [BeliefAssignment(3, {0b001: 1.0}), BeliefAssignment(3, {0b010: 1.0}), vacuous(3)]
    third = pytest.approx(1 / 3)
    assert pcr6(opposed).belief.masses == {0b001: third, 0b010: third, 0b111: third}
    assert dubois_prade(opposed).belief.masses == {0b111: 1.0}


@given(sources=several)
def test_all_rules_see_the_same_conflict(sources: list[BeliefAssignment]) -> None:
    conflicts = [rule(sources).conflict for rule in RULES.values()]
    assert max(conflicts) - min(conflicts) < 1e-9


@st.composite
def agreeing(draw: st.DrawFn) -> list[BeliefAssignment]:
    """Sources all of whose sets have a hypothesis in common."""
    common = 1 << draw(st.integers(0, SIZE - 1))
    drawn = draw(several)
    return [normalised(SIZE, {subset | common: mass for subset, mass in source.masses.items()}) for source in drawn]


@given(sources=agreeing())
def test_without_conflict_all_rules_give_the_same(sources: list[BeliefAssignment]) -> None:
    beliefs = [rule(sources).belief for rule in RULES.values()]
    assert all(mass_gap(belief, beliefs[0]) < 1e-9 for belief in beliefs)


@given(sources=several)
def test_yagers_beliefs_are_dempsters_times_the_agreement(sources: list[BeliefAssignment]) -> None:
    by_yager, by_dempster = yager(sources), dempster(sources)
    for subset in range(1, EVERYTHING):
        expected = by_dempster.belief.masses.get(subset, 0.0) * (1 - by_dempster.conflict)
        assert by_yager.belief.masses.get(subset, 0.0) == pytest.approx(expected, abs=1e-9)


@given(sources=several)
def test_nothing_is_believed_more_by_yager_than_by_dubois_and_prade(sources: list[BeliefAssignment]) -> None:
    cautious, bolder = yager(sources).belief, dubois_prade(sources).belief
    assert all(cautious.belief(s) <= bolder.belief(s) + 1e-9 for s in range(1, EVERYTHING + 1))


@by_rule
@given(sources=several)
def test_what_all_sources_are_certain_of_stays_certain(rule: Rule, sources: list[BeliefAssignment]) -> None:
    core = 0
    for source in sources:
        for subset in source.masses:
            core |= subset
    combined = rule(sources)
    if combined.conflict < 1 - 1e-9 and rule is not yager:
        assert combined.belief.belief(core) == pytest.approx(1.0)
    assert combined.belief.plausibility(core) == pytest.approx(1.0)


# --- exact cases -------------------------------------------------------------------------------------------------------

M, T, C = 0b001, 0b010, 0b100
ZADEH = (BeliefAssignment(3, {M: 0.99, T: 0.01}), BeliefAssignment(3, {C: 0.99, T: 0.01}))
PCR_OF_ZADEH = 0.99 * 0.99 / 2 + 0.99 * 0.99 * 0.01


@pytest.mark.parametrize(
    ("rule", "masses"),
    [
        (dempster, {T: 1.0}),
        (yager, {T: 0.0001, M | T | C: 0.9999}),
        (dubois_prade, {M | C: 0.9801, C | T: 0.0099, M | T: 0.0099, T: 0.0001}),
        (pcr6, {M: PCR_OF_ZADEH, C: PCR_OF_ZADEH, T: 0.0001 + 2 * 0.99 * 0.01 * 0.01}),
    ],
    ids=RULES.keys(),
)
def test_zadehs_case_exactly(rule: Rule, masses: dict[int, float]) -> None:
    combined = rule(ZADEH)
    assert combined.belief.masses == pytest.approx(masses, abs=1e-12)
    assert combined.conflict == pytest.approx(0.9999, abs=1e-12)


def test_zadehs_case_by_pcr6_is_the_published_one() -> None:
    assert pcr6(ZADEH).belief.singletons() == pytest.approx([0.499851, 0.000298, 0.499851], abs=5e-7)


def test_zadehs_case_discounted_by_a_tenth() -> None:
    belief = dempster([source.discounted(0.1) for source in ZADEH]).belief
    assert belief.singletons() == pytest.approx([0.46875, 0.00990, 0.46875], abs=5e-6)
    assert belief.unknown == pytest.approx(0.05261, abs=5e-6)


def test_total_conflict_is_flagged_by_every_rule_and_never_nan() -> None:
    opposed = [BeliefAssignment(3, {M: 1.0}), BeliefAssignment(3, {T: 1.0})]
    assert {name: rule(opposed).belief.masses for name, rule in RULES.items()} == {
        "dempster": {M | T | C: 1.0},
        "yager": {M | T | C: 1.0},
        "dubois_prade": {M | T: 1.0},
        "pcr6": {M: 0.5, T: 0.5},
    }
    assert all(rule(opposed).conflict == 1.0 for rule in RULES.values())


def test_many_sources_that_conflict_a_little_each_are_no_total_conflict() -> None:
    source = BeliefAssignment(2, {0b01: 0.6, 0b10: 0.4})
    combined = dempster([source] * 60)
    assert combined.belief.singletons() == pytest.approx([1.0, 0.0], abs=1e-9)
    assert combined.conflict == pytest.approx(1.0)


@by_rule
def test_sources_that_cannot_be_combined_are_refused(rule: Rule) -> None:
    with pytest.raises(ValueError, match="there is none"):
        rule([])
    with pytest.raises(ValueError, match="the frames differ: 2, 3 hypotheses"):
        rule([vacuous(2), vacuous(3)])


@pytest.mark.parametrize("rule", [dubois_prade, pcr6], ids=["dubois_prade", "pcr6"])
def test_more_products_than_can_be_formed_are_refused(rule: Rule) -> None:
    size = 1200
    single = normalised(size, {1 << i: 1.0 for i in range(size)})
    with pytest.raises(ValueError, match="1440000 products"):
        rule([single, single])


# --- other implementations ---------------------------------------------------------------------------------------------

NAMES = "abcd"


def by_evidencelib(name: str, sources: Sequence[BeliefAssignment]) -> BeliefAssignment:
    library = pytest.importorskip("evidencelib", reason="evidencelib is not installed (requirements-dev.txt)")
    frame = library.Frame.dst(list(NAMES))
    atoms = frame.symbols()

    def proposition(subset: int) -> object:
        found = frame.empty
        for i, atom in enumerate(atoms):
            if subset >> i & 1:
                found = found | atom
        return found

    sets = {subset: proposition(subset) for subset in range(1, EVERYTHING + 1)}
    masses = [frame.mass({sets[s]: mass for s, mass in source.masses.items()}) for source in sources]
    result = getattr(masses[0], name)(*masses[1:])
    return normalised(SIZE, {s: result.mass(sets[s]) for s in sets})


@pytest.mark.parametrize("name", RULES)
@settings(max_examples=50, deadline=None)
@given(sources=st.lists(assignments(), min_size=2, max_size=4))
def test_every_rule_agrees_with_evidencelib(name: str, sources: list[BeliefAssignment]) -> None:
    ours = RULES[name](sources)  # type: ignore[index]
    assume(name != "dempster" or ours.conflict < 1 - 1e-9)  # total conflict: that library raises
    assert mass_gap(ours.belief, by_evidencelib(name, sources)) < 1e-9


@given(sources=st.lists(assignments(), min_size=2, max_size=4))
def test_dempsters_rule_agrees_with_py_dempster_shafer(sources: list[BeliefAssignment]) -> None:
    library = pytest.importorskip("pyds", reason="py_dempster_shafer is not installed (requirements-dev.txt)")
    ours = dempster(sources)
    assume(ours.conflict < 1 - 1e-9)  # total conflict: that library divides by 0
    names = {s: frozenset(NAMES[i] for i in range(SIZE) if s >> i & 1) for s in range(1, EVERYTHING + 1)}
    first, *others = [library.MassFunction({names[s]: m for s, m in source.masses.items()}) for source in sources]
    theirs = first
    for other in others:
        theirs = theirs & other
    assert mass_gap(ours.belief, normalised(SIZE, {s: theirs[name] for s, name in names.items()})) < 1e-9
    assert all(abs(ours.belief.belief(s) - theirs.bel(name)) < 1e-9 for s, name in names.items())
    assert all(abs(ours.belief.plausibility(s) - theirs.pl(name)) < 1e-9 for s, name in names.items())
    pignistic = theirs.pignistic()
    assert ours.belief.pignistic() == pytest.approx([pignistic[frozenset(name)] for name in NAMES], abs=1e-9)


@given(source=assignments(), rate=st.floats(0, 1))
def test_discounting_agrees_with_evidencelib(source: BeliefAssignment, rate: float) -> None:
    library = pytest.importorskip("evidencelib", reason="evidencelib is not installed (requirements-dev.txt)")
    frame = library.Frame.dst(list(NAMES))
    a, *rest = frame.symbols()
    assert rest
    lone = source.masses.get(0b0001, 0.0)
    theirs = frame.mass({a: lone, frame.total: 1 - lone}) if lone else frame.mass({frame.total: 1.0})
    ours = normalised(SIZE, {0b0001: lone, EVERYTHING: 1 - lone}).discounted(rate)
    expected = theirs.discount(1 - rate)
    assert ours.masses.get(0b0001, 0.0) == pytest.approx(expected.mass(a), abs=1e-9)
    assert ours.unknown == pytest.approx(expected.mass(frame.total), abs=1e-9)
