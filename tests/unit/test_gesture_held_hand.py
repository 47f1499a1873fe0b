"""What a held hand shows, and the log odds that add up from it."""

import math

import numpy as np
import pytest
from deixis_gesture.fingertips import Finger
from deixis_gesture.hand import HandShape
from deixis_gesture.held_hand import held_hand
from deixis_gesture.log_odds import LogOdds, Table, weights_at
from deixis_gesture.phases import Way
from deixis_gesture.pointing_odds import FRAME_KNOTS, STROKE_KNOTS, frame_measures, frame_odds, stroke_measures, stroke_odds
from hypothesis import given
from hypothesis import strategies as st

places = st.floats(-8, 8)


def _shape(palm, tip, area=0.4):
    return HandShape(np.ones((4, 4), np.uint8), palm, tip, palm, 0.25, palm, area)


def test_a_right_hand_shows_what_its_mirror_image_shows():
    left = held_hand(_shape((2.5, 1.0), (3.1, 0.9)), [Finger((3.1, 0.9), 0.4)], "left", (-1.1, 4.2))
    right = held_hand(_shape((-2.5, 1.0), (-3.1, 0.9)), [Finger((-3.1, 0.9), 0.4)], "right", (1.1, 4.2))
    assert left == right
    assert left.palm == (2.5, 1.0)
    assert left.fellow == (1.1, 4.2)


def test_a_hand_of_unknown_side_is_taken_as_on_its_own_side():
    assert held_hand(_shape((-2.0, 1.0), (-2.4, 1.0)), [], None, None).palm == (2.0, 1.0)


@pytest.mark.parametrize(("tip", "bend"), [((3.0, 1.6), 0.0), ((2.0, 0.6), 90.0), ((2.0, 2.6), -90.0)])
def test_a_hand_that_goes_on_as_the_arm_does_is_not_bent_and_upward_is_positive(tip, bend):
    assert held_hand(_shape((2.0, 1.6), tip), [], "left", None).bend_deg == pytest.approx(bend, abs=1e-6)


def test_up_is_up_for_an_arm_across_the_body_too():
    assert held_hand(_shape((-1.0, 1.6), (-1.0, 0.9)), [], "left", None).bend_deg == pytest.approx(90.0)


@given(places, places)
def test_the_weights_of_a_table_are_shares(x, y):
    weights = weights_at(tuple(np.array(axis) for axis in FRAME_KNOTS["place"]), (x, y))
    assert weights.sum() == pytest.approx(1.0)
    assert weights.min() >= 0


@given(st.floats(-1, 3))
def test_a_table_is_interpolated_between_its_knots_and_kept_beyond(x):
    table = Table((np.array([0.0, 1.0, 2.0]),), np.array([5.0, 7.0, 3.0]))
    assert table.at(x) == pytest.approx(np.interp(x, [0, 1, 2], [5, 7, 3]))


def test_what_is_not_measured_says_nothing():
    odds = LogOdds(1.0, {"a": Table((np.array([0.0]),), np.array([2.0])), "b": Table((np.array([0.0]),), np.array([-9.0]))})
    assert odds.parts({"a": (0.5,)}) == {"a": 2.0}


def test_the_stored_tables_fit_their_knots():
    for odds, knots in ((frame_odds(), FRAME_KNOTS), (stroke_odds(), STROKE_KNOTS)):
        for name, axes in knots.items():
            assert odds.tables[name].values.shape == tuple(len(axis) for axis in axes)
            assert np.isfinite(odds.tables[name].values).all()


def test_every_measure_has_a_table():
    hand = held_hand(_shape((2.5, 1.0), (3.1, 0.9)), [], "left", (-1.1, 4.2))
    alone = held_hand(_shape((2.5, 1.0), (3.1, 0.9)), [], "left", None)
    assert set(frame_measures(hand)) | set(frame_measures(alone)) == set(FRAME_KNOTS)
    coming, found = stroke_measures(0.0, 0.5, 0.02, Way(0.6, 3.0, 1.0)), stroke_measures(0.0, 0.5, 0.02, None)
    assert set(coming) | set(found) == set(STROKE_KNOTS)


def test_an_arm_stretched_aside_points_rather_than_a_hand_at_the_chin():
    def told(palm, tip):
        odds = frame_odds()
        return odds.constant + math.fsum(
            odds.parts(frame_measures(held_hand(_shape(palm, tip, 0.25), [], "left", None))).values()
        )

    assert told((3.2, 1.0), (3.8, 0.9)) > 1 > -1 > told((0.3, 0.8), (0.2, 0.5))
