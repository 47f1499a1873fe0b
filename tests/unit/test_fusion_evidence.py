"""The paper's evidence to the letter."""

from __future__ import annotations

import math

import pytest
from deixis_fusion.belief import BeliefAssignment, as_set
from deixis_fusion.config import FusionConfig
from deixis_fusion.confusion import fig_6, table_1
from deixis_fusion.evidence import Evidence, HandObservation, HeadObservation, Witness
from deixis_fusion.fusion import rules_of
from deixis_fusion.paper_rules import PaperRules, face_assignment, gesture_sets, largest_focal_sets
from deixis_fusion.pointing import PointingGesture
from deixis_fusion.visibility import Candidate
from deixis_schemas.messages import Poi
from hypothesis import given
from hypothesis import strategies as st

PAPER = FusionConfig(rules="paper")
LIMITS = (40.0, 140.0)
SAID = Witness("ok", "")
bearings = st.lists(st.floats(-179, 179), min_size=1, max_size=12)
gestures = st.sampled_from(["point_left", "invisible", "point_right"])


def seen(*degrees: float, sigma: float = 3.0) -> list[Candidate]:
    return [Candidate(Poi(poi_id=f"P{i}", position_m=(0, 0, 0)), d, sigma) for i, d in enumerate(degrees)]


def test_equation_16_counts_the_pois_of_each_region() -> None:
    # Eight POIs as in figure 5: two on the left, two on the right, four in the centre (front and back).
    degrees = [10, -20, 60, 100, -60, -100, 160, 175]
    assignment = gesture_sets("point_left", degrees, LIMITS, table_1())
    left, center = as_set([2, 3]), as_set([0, 1, 6, 7])
    total = 0.90 * 2 / 8 + 0.05 * 4 / 8
    assert assignment.masses == {left: pytest.approx(0.90 * 2 / 8 / total), center: pytest.approx(0.05 * 4 / 8 / total)}


def test_an_invisible_gesture_speaks_for_the_centre() -> None:
    assignment = gesture_sets("invisible", [0, 60, -60], LIMITS, table_1())
    assert assignment.masses[0b001] == pytest.approx(0.9 / 1.1)


def test_a_gesture_that_no_poi_explains_is_vacuous() -> None:
    assert gesture_sets("point_left", [-60, -90], LIMITS, table_1()).unknown == 1.0


@given(bearings, gestures)
def test_equation_16_gives_an_assignment_for_any_arrangement(degrees: list[float], gesture: PointingGesture) -> None:
    masses = gesture_sets(gesture, degrees, LIMITS, table_1()).masses
    assert math.fsum(masses.values()) == pytest.approx(1.0)


def test_equation_18_is_proportional_to_the_likelihoods() -> None:
    assert face_assignment([0.2, 0.6, 0.0], [False] * 3).singletons() == pytest.approx([0.25, 0.75, 0.0])


def test_a_face_not_computed_puts_the_far_pois_mass_on_their_set() -> None:
    assignment = face_assignment([0.1, 0.4, 0.5], far=[False, True, True])
    assert assignment.masses == {0b001: pytest.approx(0.1), 0b110: pytest.approx(0.9)}


def head_masses(head: HeadObservation, *degrees: float) -> BeliefAssignment:
    return PaperRules(PAPER.paper, PAPER.confusion).head(head, seen(*degrees))


def fig_6_share(perceived: int | None, intended: int) -> float:
    """The number in the table; of none, that of the row "not computed"."""
    column = fig_6().intended_deg.index(intended)
    return (fig_6().not_computed if perceived is None else fig_6().table[fig_6().perceived_deg.index(perceived)])[column]


def test_the_papers_head_not_computed_is_that_row_of_figure_6() -> None:
    assignment = head_masses(HeadObservation(None), 0, 60, 130, -150)
    near, side, beyond = (fig_6_share(None, yaw) for yaw in (0, 60, 130))
    total = near + side + beyond + 1
    assert assignment.masses == {
        0b0001: pytest.approx(near / total),
        0b0010: pytest.approx(side / total),
        0b1100: pytest.approx((beyond + 1) / total),
    }


def test_the_papers_head_is_read_between_the_columns_of_figure_6() -> None:
    # 65 lies halfway between 60 and 70; nothing to the other side, nor far off, is read as 60.
    at, between = fig_6_share(60, 60), (fig_6_share(60, 60) + fig_6_share(60, 70)) / 2
    masses = head_masses(HeadObservation(60.0, 3.0), 60, 65, 120, -60).singletons()
    assert masses == pytest.approx([at / (at + between), between / (at + between), 0, 0])


def test_a_yaw_that_no_poi_explains_is_vacuous() -> None:
    assert head_masses(HeadObservation(0.0), 60, -100).unknown == 1.0


@pytest.mark.parametrize("head", [HeadObservation(None, beyond_deg=100), HeadObservation(125, 3)])
def test_the_papers_head_has_the_range_of_the_stage_that_read_it(head: HeadObservation) -> None:
    limit = 110 if head.yaw_deg is None else 130
    # Of a reader that ends at 100, all heads are not computed that figure 6 reads as 110 or 120.
    beyond = 1.0 if head.yaw_deg else fig_6_share(None, 110) + fig_6_share(110, 110) + fig_6_share(120, 110)
    total = fig_6_share(None, 0) + fig_6_share(None, 60) + 2 * beyond
    assert head_masses(head, 0, 60, limit, -limit).masses[0b1100] == pytest.approx(2 * beyond / total, abs=1e-4)


def test_the_papers_choice_is_the_union_of_the_largest_focal_sets() -> None:
    assert largest_focal_sets(BeliefAssignment(4, {0b0011: 0.4, 0b0100: 0.4, 0b1000: 0.2})) == (0, 1, 2)


def test_one_poi_in_sight_is_named_by_those_who_point_at_it() -> None:
    evidence = Evidence(HandObservation("point_left", 55.0, 10.0), SAID, HeadObservation(57.0, 4.0), SAID)
    assert rules_of(PAPER).judge(seen(60), evidence).poi_ids == ("P0",)


def test_the_paper_never_abstains_where_anything_was_observed() -> None:
    # All three stand on the left, and the gesture says so: the set is the whole frame.
    judged = rules_of(PAPER).judge(seen(60, 80, 100), Evidence(HandObservation("point_left"), SAID, None, SAID))
    assert judged.poi_ids == ("P0", "P1", "P2")


def test_the_paper_answers_a_total_conflict_with_all_pois() -> None:
    evidence = Evidence(HandObservation("point_left"), SAID, HeadObservation(-60.0), SAID)
    judged = rules_of(PAPER).judge(seen(60, -60), evidence)
    assert judged.combination.conflict == 1.0
    assert judged.poi_ids == ("P0", "P1")


@pytest.mark.parametrize("degrees", [(60.0,), (60.0, -60.0)])
def test_with_both_sources_silent_the_answer_is_none(degrees: tuple[float, ...]) -> None:
    judged = rules_of(PAPER).judge(seen(*degrees), Evidence(None, SAID, None, SAID))
    assert judged.choice.abstains == "nothing was observed that tells the POIs apart"
