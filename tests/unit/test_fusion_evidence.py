"""The paper's evidence to the letter, and ours beyond it."""

from __future__ import annotations

import math

import pytest
from deixis_fusion.belief import BeliefAssignment, as_set, vacuous
from deixis_fusion.config import FusionConfig, HandConfig
from deixis_fusion.decision import Judgement, decide
from deixis_fusion.deixis_rules import best_by_pignistic, hand_assignment, head_assignment
from deixis_fusion.evidence import Evidence, HandObservation, HeadObservation, PointingGesture, Witness
from deixis_fusion.fusion import rules_of
from deixis_fusion.localisation import wrapped_deg
from deixis_fusion.paper_rules import TABLE_1, PaperRules, face_assignment, gesture_sets, largest_focal_sets
from deixis_fusion.visibility import Candidate
from deixis_schemas.messages import Poi, Side
from hypothesis import given
from hypothesis import strategies as st

CONFIG = FusionConfig()
PAPER = FusionConfig(rules="paper")
LIMITS = (40.0, 140.0)
AROUND = (-130.0, -105.0, -81.0, -56.0, -31.0, 0.0, 31.0, 56.0, 81.0, 105.0, 130.0)
bearings = st.lists(st.floats(-179, 179), min_size=1, max_size=12)
gestures = st.sampled_from(["point_left", "invisible", "point_right"])


def seen(*degrees: float, sigma: float = 3.0) -> list[Candidate]:
    return [Candidate(Poi(poi_id=f"P{i}", position_m=(0, 0, 0)), d, sigma) for i, d in enumerate(degrees)]


def judge(
    candidates: list[Candidate], hand: HandObservation | None, head: HeadObservation | None, config: FusionConfig = CONFIG
) -> Judgement:
    said = Witness("ok", "")
    return decide(candidates, Evidence(hand, said, head, said), rules_of(config), config.answer.max_unknown)


def best(assignment: BeliefAssignment, degrees: tuple[float, ...] = AROUND) -> float:
    pignistic = assignment.pignistic()
    return degrees[pignistic.index(max(pignistic))]


def test_every_column_of_table_1_sums_to_one() -> None:
    for region in ("left", "center", "right"):
        assert sum(TABLE_1[gesture][region] for gesture in TABLE_1) == pytest.approx(1.0)


def test_equation_16_counts_the_pois_of_each_region() -> None:
    # Eight POIs as in figure 5: two on the left, two on the right, four in the centre (front and back).
    degrees = [10, -20, 60, 100, -60, -100, 160, 175]
    assignment = gesture_sets("point_left", degrees, LIMITS)
    left, center = as_set([2, 3]), as_set([0, 1, 6, 7])
    total = 0.90 * 2 / 8 + 0.05 * 4 / 8
    assert assignment.masses == {left: pytest.approx(0.90 * 2 / 8 / total), center: pytest.approx(0.05 * 4 / 8 / total)}


def test_an_invisible_gesture_speaks_for_the_centre() -> None:
    assignment = gesture_sets("invisible", [0, 60, -60], LIMITS)
    assert assignment.masses[0b001] == pytest.approx(0.9 / 1.1)


def test_a_gesture_that_no_poi_explains_is_vacuous() -> None:
    assert gesture_sets("point_left", [-60, -90], LIMITS).unknown == 1.0


@given(bearings, gestures)
def test_equation_16_gives_an_assignment_for_any_arrangement(degrees: list[float], gesture: PointingGesture) -> None:
    masses = gesture_sets(gesture, degrees, LIMITS).masses
    assert math.fsum(masses.values()) == pytest.approx(1.0)


def test_equation_18_is_proportional_to_the_likelihoods() -> None:
    assert face_assignment([0.2, 0.6, 0.0], None).singletons() == pytest.approx([0.25, 0.75, 0.0])


def test_a_face_not_computed_puts_the_far_pois_mass_on_their_set() -> None:
    assignment = face_assignment([0.1, 0.4, 0.5], far=[False, True, True])
    assert assignment.masses == {0b001: pytest.approx(0.1), 0b110: pytest.approx(0.9)}


def test_the_papers_head_out_of_range_means_the_pois_out_there() -> None:
    assignment = PaperRules(PAPER.paper).head(HeadObservation(None), seen(0, 60, 150, -150))
    assert assignment.masses == {0b1100: pytest.approx(1.0)}


def test_the_papers_choice_is_the_union_of_the_largest_focal_sets() -> None:
    assert largest_focal_sets(BeliefAssignment(4, {0b0011: 0.4, 0b0100: 0.4, 0b1000: 0.2})) == (0, 1, 2)


def test_without_a_bearing_our_hand_agrees_with_equation_16_far_from_the_borders() -> None:
    degrees = (0.0, 90.0, -90.0, 180.0)
    ours = hand_assignment(HandObservation("point_left"), seen(*degrees), HandConfig(miss=0.1))
    paper = gesture_sets("point_left", degrees, LIMITS).discounted(CONFIG.hand.discount)
    assert ours.pignistic() == pytest.approx(paper.pignistic(), abs=0.03)


def test_the_hands_bearing_singles_out_one_poi() -> None:
    hand = HandObservation("point_left", bearing_deg=60, bearing_sigma_deg=8)
    assert best(hand_assignment(hand, seen(*AROUND), CONFIG.hand)) == 56


def test_a_mirrored_bearing_speaks_for_front_and_back_alike() -> None:
    degrees = (30.0, 60.0, 90.0, 120.0, -60.0)
    hand = HandObservation("point_left", bearing_deg=60, bearing_sigma_deg=8, mirrored=True)
    pignistic = hand_assignment(hand, seen(*degrees), CONFIG.hand).pignistic()
    assert pignistic[1] == pytest.approx(pignistic[3], rel=0.15)
    assert min(pignistic[1], pignistic[3]) > 2 * max(pignistic[0], pignistic[2], pignistic[4])


@pytest.mark.parametrize("yaw", [-81, -56, -31, 31, 56, 81])
def test_a_head_that_turns_the_whole_way_names_the_poi(yaw: float) -> None:
    assert best(head_assignment(HeadObservation(yaw, 3), seen(*AROUND), CONFIG.head)) == yaw


@pytest.mark.parametrize("target", [-81.0, -56.0, 56.0, 81.0])
def test_a_head_that_turns_seven_tenths_of_the_way_is_understood_with_the_hand(target: float) -> None:
    hand = HandObservation("point_left" if target > 0 else "point_right", target, 10)
    judgement = judge(seen(*AROUND), hand, HeadObservation(0.7 * target, 3))
    assert best(judgement.combination.belief) == target


def test_a_look_at_the_robot_leaves_the_word_to_the_hand() -> None:
    hand = HandObservation("point_left", 58, 8)
    judgement = judge(seen(-56, -31, 31, 56, 81), hand, HeadObservation(1, 3))
    assert judgement.head.unknown > 0.5
    assert judgement.choice.hypotheses == (3,)


def test_a_yaw_that_fits_no_poi_is_ignorance_not_the_least_bad_poi() -> None:
    assert head_assignment(HeadObservation(-80, 3), seen(60, 90), CONFIG.head).unknown > 0.9


@pytest.mark.parametrize(("side", "expected"), [("left", {130.0, 105.0}), ("right", {-130.0, -105.0})])
def test_out_of_range_means_the_far_pois_on_that_side(side: Side, expected: set[float]) -> None:
    narrow = CONFIG.head.model_copy(update={"range_deg": 95})  # as of a guest that reads heads less far
    pignistic = head_assignment(HeadObservation(None, side=side), seen(*AROUND), narrow).pignistic()
    order = sorted(range(len(AROUND)), key=lambda i: -pignistic[i])
    assert {AROUND[i] for i in order[:2]} == expected


def test_out_of_range_with_no_poi_out_there_is_vacuous() -> None:
    assert head_assignment(HeadObservation(None), seen(-30, 0, 30), CONFIG.head).unknown == pytest.approx(1.0, abs=1e-6)


@given(bearings, st.floats(-120, 120), st.floats(0.5, 40))
def test_our_head_always_gives_an_assignment(degrees: list[float], yaw: float, sigma: float) -> None:
    masses = head_assignment(HeadObservation(yaw, sigma), seen(*degrees), CONFIG.head).masses
    assert math.fsum(masses.values()) == pytest.approx(1.0)


hands = st.builds(
    HandObservation, gestures, st.floats(-180, 180), st.floats(0.5, 90), mirrored=st.booleans(), agreement=st.floats(0, 1)
)


@given(bearings, hands)
def test_our_hand_always_gives_an_assignment(degrees: list[float], hand: HandObservation) -> None:
    masses = hand_assignment(hand, seen(*degrees), CONFIG.hand).masses
    assert math.fsum(masses.values()) == pytest.approx(1.0)


@given(bearings, gestures, st.floats(-120, 120))
def test_left_and_right_are_mirror_images(degrees: list[float], gesture: PointingGesture, yaw: float) -> None:
    mirror: dict[PointingGesture, PointingGesture] = {
        "point_left": "point_right", "point_right": "point_left", "invisible": "invisible",
    }  # fmt: skip
    one = judge(seen(*degrees), HandObservation(gesture), HeadObservation(yaw, 3))
    flipped = judge(seen(*[-d for d in degrees]), HandObservation(mirror[gesture]), HeadObservation(-yaw, 3))
    assert one.combination.belief.pignistic() == pytest.approx(flipped.combination.belief.pignistic(), abs=1e-6)


@given(bearings, gestures, st.floats(-90, 90))
def test_one_wrong_source_is_never_total_conflict(degrees: list[float], gesture: PointingGesture, yaw: float) -> None:
    assert judge(seen(*degrees), HandObservation(gesture), HeadObservation(yaw, 3)).combination.conflict < 1


def test_a_silent_source_leaves_the_other_one_as_it_is() -> None:
    candidates = seen(*AROUND)
    judgement = judge(candidates, None, HeadObservation(56, 3))
    assert judgement.hand == vacuous(len(AROUND))
    assert judgement.combination.belief.pignistic() == pytest.approx(judgement.head.pignistic())


def test_with_both_sources_silent_the_answer_is_none() -> None:
    judgement = judge(seen(*AROUND), None, None)
    assert judgement.choice.hypotheses == ()
    assert judgement.choice.abstains
    assert judge(seen(*AROUND), None, None, PAPER).choice.hypotheses == ()


def test_close_contenders_are_tied_best_first() -> None:
    belief = BeliefAssignment(3, {0b001: 0.44, 0b010: 0.5, 0b100: 0.06})
    assert best_by_pignistic(belief, 0.1) == (1, 0)
    assert best_by_pignistic(belief, 0.01) == (1,)


@given(st.floats(-2000, 2000))
def test_wrapped_angles_stay_within_half_a_turn(angle: float) -> None:
    assert -180 <= wrapped_deg(angle) <= 180
    assert math.isclose(math.cos(math.radians(wrapped_deg(angle))), math.cos(math.radians(angle)), abs_tol=1e-6)


# --- what was wrong, each once ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("config", [CONFIG, PAPER])
def test_one_poi_in_sight_is_named_by_those_who_point_at_it(config: FusionConfig) -> None:
    judged = judge(seen(60), HandObservation("point_left", 55.0, 10.0), HeadObservation(57.0, 4.0), config)
    assert judged.poi_ids == ("P0",)


@pytest.mark.parametrize("config", [CONFIG, PAPER])
def test_one_poi_in_sight_is_not_named_where_nothing_was_observed(config: FusionConfig) -> None:
    assert judge(seen(60), None, None, config).choice.abstains == "nothing was observed that tells the POIs apart"


def test_one_poi_in_sight_is_not_named_by_those_who_point_away_from_it() -> None:
    judged = judge(seen(60), HandObservation("point_right", -60.0, 10.0), HeadObservation(-60.0, 4.0))
    assert judged.poi_ids == ()
    assert "does not lie where hand and head point" in judged.choice.abstains


@pytest.mark.parametrize("count", [2, 20, 200])
def test_contour_conflict_is_low_in_agreement_and_high_in_contradiction_at_any_number_of_pois(count: int) -> None:
    around = seen(*(-90 + 180 * i / (count - 1) for i in range(count)))
    bearing = around[count // 8].bearing_deg
    pointing = HandObservation("point_right", bearing, 8.0)
    agrees = judge(around, pointing, HeadObservation(bearing, 4.0))
    contradicts = judge(around, pointing, HeadObservation(-bearing, 4.0))
    assert agrees.contour_conflict <= 0.06
    assert contradicts.contour_conflict >= 0.97


def test_hand_and_head_that_contradict_each_other_are_no_answer() -> None:
    judged = judge(seen(*AROUND), HandObservation("point_left", 81.0, 8.0), HeadObservation(-81.0, 4.0))
    assert judged.poi_ids == ()
    assert "contradict each other" in judged.choice.abstains


@given(st.floats(60, 179))
def test_one_degree_more_of_the_farthest_poi_changes_what_out_of_range_says_by_little(degrees: float) -> None:
    head = HeadObservation(None, None, "left")
    here, farther = (head_assignment(head, seen(-30, 0, d), CONFIG.head).unknown for d in (degrees, degrees + 1))
    assert abs(here - farther) < 0.12
