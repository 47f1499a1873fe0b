"""Our rules beyond the paper's: likelihoods of hand and head, masses that explain them, and the answer."""

from __future__ import annotations

import numpy as np
import pytest
from deixis_fusion.config import FusionConfig
from deixis_fusion.confusion import table_1
from deixis_fusion.curves import BEARINGS, at, gesture_curve, hand_curve, head_curve
from deixis_fusion.decision import Judgement
from deixis_fusion.deixis_rules import likeliest
from deixis_fusion.evidence import Evidence, HandObservation, HeadObservation, PointingGesture, Witness
from deixis_fusion.fusion import rules_of
from deixis_fusion.localisation import PersonPlace, wrapped_deg
from deixis_fusion.pointing import GESTURES
from deixis_fusion.sight import Lookout, Points
from deixis_fusion.visibility import Candidate, Walls
from deixis_schemas.messages import Poi, Side
from hypothesis import given
from hypothesis import strategies as st

CONFIG = FusionConfig()
AROUND = (-130.0, -105.0, -81.0, -56.0, -31.0, 0.0, 31.0, 56.0, 81.0, 105.0, 130.0)
SAID = Witness("ok", "")
bearings = st.lists(st.floats(-179, 179), min_size=1, max_size=12)
gestures = st.sampled_from(["point_left", "invisible", "point_right"])


def seen(*degrees: float, sigma: float = 3.0) -> list[Candidate]:
    return [Candidate(Poi(poi_id=f"P{i}", position_m=(0, 0, 0)), d, sigma) for i, d in enumerate(degrees)]


def judge(candidates: list[Candidate], hand: HandObservation | None, head: HeadObservation | None) -> Judgement:
    return rules_of(CONFIG).judge(candidates, Evidence(hand, SAID, head, SAID))


def by_hand(hand: HandObservation, *degrees: float) -> Judgement:
    return judge(seen(*degrees), hand, None)


def by_head(head: HeadObservation, *degrees: float) -> Judgement:
    return judge(seen(*degrees), None, head)


def best(judgement: Judgement, degrees: tuple[float, ...] = AROUND) -> float:
    return degrees[int(np.argmax(judgement.chances))]


# --- hand -------------------------------------------------------------------------------------------------------------


def test_gestures_of_a_bearing_are_all_there_are() -> None:
    # But for the floor below which no gesture falls.
    total = sum(gesture_curve(gesture, CONFIG.hand, table_1()) for gesture in GESTURES)
    assert np.all((total > 0.97) & (total < 1.05))


def test_the_hands_bearing_singles_out_one_poi() -> None:
    assert best(by_hand(HandObservation("point_left", bearing_deg=60, bearing_sigma_deg=8), *AROUND)) == 56


def test_a_mirrored_bearing_speaks_for_front_and_back_alike() -> None:
    hand = HandObservation("point_left", bearing_deg=60, bearing_sigma_deg=8, mirrored=True)
    chances = by_hand(hand, 30.0, 60.0, 90.0, 120.0, -60.0).chances
    assert chances[1] == pytest.approx(chances[3], rel=0.15)
    assert min(chances[1], chances[3]) > 2 * max(chances[0], chances[2], chances[4])


def test_a_mirrored_bearing_is_the_sum_of_both_and_none_the_mean() -> None:
    one, both = (HandObservation("point_left", 60, 8, mirrored=mirrored) for mirrored in (False, True))
    alone, mixed = hand_curve(one, CONFIG.hand), hand_curve(both, CONFIG.hand)
    here, there = (60 + 180), (120 + 180)
    assert mixed[here] == pytest.approx(alone[here], rel=0.02)
    assert mixed[there] == pytest.approx(mixed[here], rel=0.02)


def test_a_curve_is_read_between_its_degrees_and_across_its_ends() -> None:
    curve = np.cos(np.radians(BEARINGS))[None]
    asked = np.array([[-180.0, 179.9, 0.25], [60.5, -270.0, 269.5]])
    assert at(curve[None], asked[None].astype(np.float32))[0, 0] == pytest.approx(np.cos(np.radians(asked)), abs=1e-4)


# --- head -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [-81, -56, -31, 31, 56, 81])
def test_a_head_that_turns_the_whole_way_names_the_poi(yaw: float) -> None:
    assert best(by_head(HeadObservation(yaw, 3), *AROUND)) == yaw


@pytest.mark.parametrize("target", [-81.0, -56.0, 56.0, 81.0])
def test_a_head_that_turns_seven_tenths_of_the_way_is_understood_with_the_hand(target: float) -> None:
    hand = HandObservation("point_left" if target > 0 else "point_right", target, 10)
    assert best(judge(seen(*AROUND), hand, HeadObservation(0.7 * target, 3))) == target


def test_a_look_at_the_robot_leaves_the_word_to_the_hand() -> None:
    judgement = judge(seen(-56, -31, 31, 56, 81), HandObservation("point_left", 58, 8), HeadObservation(1, 3))
    assert judgement.head.unknown > 0.5
    assert judgement.choice.hypotheses == (3,)


def test_a_yaw_that_fits_no_poi_is_ignorance_not_the_least_bad_poi() -> None:
    judgement = by_head(HeadObservation(-80, 3), 60, 90)
    assert judgement.head.unknown > 0.9
    assert judgement.poi_ids == ()


@pytest.mark.parametrize(("side", "expected"), [("left", {130.0, 105.0}), ("right", {-130.0, -105.0})])
def test_out_of_range_means_the_far_pois_on_that_side(side: Side, expected: set[float]) -> None:
    judgement = by_head(HeadObservation(None, side=side, beyond_deg=95), *AROUND)  # as of a guest that reads heads less far
    order = np.argsort(-judgement.chances)
    assert {AROUND[i] for i in order[:2]} == expected


def test_out_of_range_with_no_poi_out_there_is_vacuous() -> None:
    judgement = by_head(HeadObservation(None), -30, 0, 30)
    assert judgement.head.unknown == pytest.approx(1.0, abs=1e-6)
    assert judgement.poi_ids == ()


@given(st.floats(60, 179))
def test_one_degree_more_of_the_farthest_poi_changes_what_out_of_range_says_by_little(degrees: float) -> None:
    head = HeadObservation(None, None, "left")
    here, farther = (by_head(head, -30, 0, d) for d in (degrees, degrees + 1))
    assert abs(here.head.unknown - farther.head.unknown) < 0.12
    assert abs(here.chances[2] - farther.chances[2]) < 0.12


@pytest.mark.parametrize("beyond_deg", [None, 100.0])
def test_out_of_range_does_not_outdo_a_hand_that_is_clearly_elsewhere(beyond_deg: float | None) -> None:
    judged = judge(
        seen(0, 50, 130), HandObservation("point_left", 50, 8), HeadObservation(None, side="left", beyond_deg=beyond_deg)
    )
    assert "P2" not in judged.poi_ids


def test_a_yaw_that_is_told_is_likelier_nowhere_than_the_whole_circle_allows() -> None:
    curve = head_curve(HeadObservation(40, 3), CONFIG.head)
    assert int(BEARINGS[np.argmax(curve)]) in range(36, 44)
    assert curve.min() > 0


# --- both -------------------------------------------------------------------------------------------------------------

hands = st.builds(
    HandObservation, gestures, st.floats(-180, 180), st.floats(0.5, 90), mirrored=st.booleans(), agreement=st.floats(0, 1)
)
heads = st.builds(HeadObservation, st.none() | st.floats(-120, 120), st.floats(0.5, 40), st.none(), st.floats(0, 1))


@given(bearings, st.none() | hands, st.none() | heads)
def test_chances_and_all_masses_sum_to_one(
    degrees: list[float], hand: HandObservation | None, head: HeadObservation | None
) -> None:
    judged = judge(seen(*degrees), hand, head)
    assert judged.chances.sum() == pytest.approx(1.0)
    for masses in (judged.hand, judged.head, judged.combination.belief):
        assert masses.single.sum() + sum(mass for _, mass in masses.sets) == pytest.approx(1.0)
    assert judged.combination.conflict < 1


@given(bearings, gestures, st.floats(-120, 120))
def test_left_and_right_are_mirror_images(degrees: list[float], gesture: PointingGesture, yaw: float) -> None:
    mirror: dict[PointingGesture, PointingGesture] = {
        "point_left": "point_right", "point_right": "point_left", "invisible": "invisible",
    }  # fmt: skip
    one = judge(seen(*degrees), HandObservation(gesture), HeadObservation(yaw, 3))
    flipped = judge(seen(*[-d for d in degrees]), HandObservation(mirror[gesture]), HeadObservation(-yaw, 3))
    # Bearings are in single precision, of which degrees at 180 and at 0 have not as many.
    assert one.chances == pytest.approx(flipped.chances, abs=1e-4)


def test_a_silent_source_leaves_the_other_one_as_it_is() -> None:
    judgement = by_head(HeadObservation(56, 3), *AROUND)
    assert judgement.hand.unknown == 1
    assert judgement.pignistic == pytest.approx(judgement.head.pignistic())


@pytest.mark.parametrize("degrees", [(60.0,), AROUND])
def test_with_both_sources_silent_the_answer_is_none(degrees: tuple[float, ...]) -> None:
    assert judge(seen(*degrees), None, None).choice.abstains == "nothing was observed that tells the POIs apart"


def test_a_lone_poi_is_named_by_those_who_point_at_it() -> None:
    assert judge(seen(60), HandObservation("point_left", 55.0, 10.0), HeadObservation(57.0, 4.0)).poi_ids == ("P0",)


@pytest.mark.parametrize(("degrees", "says"), [((60.0,), "the only POI in sight does not lie"), ((60.0, 80.0), "no POI in")])
def test_no_poi_is_named_by_those_who_point_away_from_all(degrees: tuple[float, ...], says: str) -> None:
    judged = judge(seen(*degrees), HandObservation("point_right", -60.0, 10.0), HeadObservation(-60.0, 4.0))
    assert judged.poi_ids == ()
    assert says in judged.choice.abstains


def test_a_gesture_alone_that_all_pois_explain_alike_tells_nothing() -> None:
    judged = judge(seen(80, 85, 90), HandObservation("point_left"), None)
    assert judged.choice.abstains == "nothing was observed that tells the POIs apart"


@pytest.mark.parametrize("count", [2, 20, 200])
def test_contour_conflict_is_low_in_agreement_and_high_in_contradiction_at_any_number_of_pois(count: int) -> None:
    around = seen(*(-90 + 180 * i / (count - 1) for i in range(count)))
    bearing = around[count // 8].bearing_deg
    pointing = HandObservation("point_right", bearing, 8.0)
    assert judge(around, pointing, HeadObservation(bearing, 4.0)).contour_conflict <= 0.06
    assert judge(around, pointing, HeadObservation(-bearing, 4.0)).contour_conflict >= 0.97


def test_hand_and_head_that_contradict_each_other_are_no_answer() -> None:
    judged = judge(seen(*AROUND), HandObservation("point_left", 81.0, 8.0), HeadObservation(-81.0, 4.0))
    assert judged.poi_ids == ()
    assert "contradict each other" in judged.choice.abstains


# --- what an answer depends on ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("others", [0, 6, 100, 1000])
def test_the_odds_of_two_pois_do_not_depend_on_how_many_others_there_are(others: int) -> None:
    behind = [float(d) for d in np.linspace(-170, -100, others)]
    chances = judge(seen(60, 80, *behind), HandObservation("point_left", 62, 12), HeadObservation(61, 4)).chances
    alone = judge(seen(60, 80), HandObservation("point_left", 62, 12), HeadObservation(61, 4)).chances
    assert chances[0] / chances[1] == pytest.approx(alone[0] / alone[1], rel=1e-9)


@given(st.lists(st.floats(1e-9, 1), min_size=1, max_size=30), st.floats(0.05, 1))
def test_ties_go_by_the_ratio_of_chances(weights: list[float], ratio: float) -> None:
    chances = np.array(weights) / sum(weights)
    tied = likeliest(chances, ratio)
    assert chances[tied[0]] == chances.max()
    assert set(tied) == {i for i, chance in enumerate(chances) if chance >= ratio * chances.max()}


def test_two_hundred_pois_around_are_not_equally_likely() -> None:
    around = seen(*np.linspace(-179, 179, 200).tolist())
    judged = judge(around, HandObservation("point_left", 60, 10), HeadObservation(60, 3))
    assert 5 < len(judged.credible) < 30
    assert all(30 < around[i].bearing_deg < 90 for i in judged.credible)
    assert judged.chances[list(judged.credible)].sum() >= CONFIG.answer.credible
    assert "too near each other to be told apart" in judged.choice.abstains


@given(bearings, st.none() | hands, st.none() | heads)
def test_the_credible_set_is_the_smallest(
    degrees: list[float], hand: HandObservation | None, head: HeadObservation | None
) -> None:
    judged = judge(seen(*degrees), hand, head)
    total = float(judged.chances[list(judged.credible)].sum())
    assert total >= CONFIG.answer.credible - 1e-9
    assert total - float(judged.chances[judged.credible[-1]]) < CONFIG.answer.credible


def test_a_person_who_may_stand_farther_off_is_one_unknown_of_hand_and_head_together() -> None:
    # Hand and head agree on a bearing 18 degrees beside the POI's likeliest: both have it there if the person stands elsewhere.
    place = PersonPlace((2, 0, 1.5), (0, 0, 1.5), 2.0, 0.4)
    pois = [Poi(poi_id=name, position_m=(2, y, 1), extent_m=0) for name, y in (("near", 1), ("far", 9))]
    sight = Lookout(0.15).look(place, Points.of(pois), Walls(()))
    shifted = wrapped_deg(float(sight.bearings.likeliest[0]) - 18)
    hand, head = HandObservation("point_left", shifted, 6.0), HeadObservation(shifted, 3.0)
    by_hand, by_head, by_both = (
        rules_of(CONFIG).judge(sight, Evidence(*said)).chances
        for said in ((hand, SAID, None, SAID), (None, SAID, head, SAID), (hand, SAID, head, SAID))
    )
    assert by_both[0] / by_both[1] > 1.3 * (by_hand[0] / by_hand[1]) * (by_head[0] / by_head[1])
