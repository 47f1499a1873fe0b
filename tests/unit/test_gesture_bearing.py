"""Bearing from one camera: sign, ambiguity, and a sigma that holds."""

import numpy as np
import pytest
from deixis_gesture.bearing import HandSight, estimate_bearing
from hypothesis import given
from hypothesis import strategies as st

DISTANCE = 10.5


def _sight(bearing, arm=4.2):
    """A hand in the camera's perspective, the index finger foreshortened; face widths."""
    b = np.radians(bearing)
    offset = DISTANCE * arm * np.sin(b) / (DISTANCE - arm * np.cos(b))
    return HandSight(float(offset), float(np.interp(abs(bearing), [0, 40, 80, 110, 140], [0.1, 0.5, 0.55, 0.28, 0.05])), 0.25)


@given(st.floats(0.2, 5.0), st.floats(0, 0.7), st.floats(0.1, 0.4), st.floats(3, 60), st.booleans())
def test_left_and_right_mirror_each_other(offset, finger, palm, distance, across):
    left = estimate_bearing(HandSight(offset, finger, palm), distance, across)
    right = estimate_bearing(HandSight(-offset, finger, palm), distance, across)
    assert left.deg == pytest.approx(-right.deg)
    assert 0 <= left.deg <= 150
    assert (left.sigma_deg, left.mirrored) == (right.sigma_deg, right.mirrored)
    assert 8 <= left.sigma_deg < 90


def test_the_stated_sigma_holds_for_arms_of_many_lengths():
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(300):
        truth = rng.uniform(15, 140)
        seen = estimate_bearing(_sight(truth, rng.normal(4.2, 0.25)), DISTANCE, False)
        options = [seen.deg, 180 - seen.deg] if seen.mirrored else [seen.deg]
        errors.append(min(abs(option - truth) for option in options) / seen.sigma_deg)
    assert 0.4 < np.sqrt(np.mean(np.square(errors))) < 1.2
    assert np.mean(np.array(errors) < 2) > 0.92


def test_pointing_aside_is_told_from_pointing_ahead():
    assert estimate_bearing(_sight(75), DISTANCE, False).deg > estimate_bearing(_sight(20), DISTANCE, False).deg + 30


def test_a_short_offset_without_a_finger_is_ambiguous_and_says_so():
    seen = estimate_bearing(HandSight(2.4, 0.05, 0.22), DISTANCE, False)
    assert seen.mirrored
    assert abs((180 - seen.deg) - 135) < 15


def test_an_arm_across_the_body_reaches_less_far():
    straight = estimate_bearing(HandSight(-2.2, 0.25, 0.3), DISTANCE, False)
    across = estimate_bearing(HandSight(-2.2, 0.25, 0.3), DISTANCE, True)
    assert abs(across.deg) > abs(straight.deg) + 10


@pytest.mark.parametrize("distance", [0.0, -1.0, float("nan")])
def test_a_distance_that_is_none_is_refused_by_name(distance):
    with pytest.raises(ValueError, match="distance"):
        estimate_bearing(HandSight(3.0, 0.5, 0.25), distance, False)
