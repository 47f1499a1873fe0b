import pytest
from deixis_tracker.kalman import PointFilter
from hypothesis import given
from hypothesis import strategies as st

numbers = st.floats(-500, 500)


@given(x=numbers, y=numbers, vx=st.floats(-200, 200))
def test_a_point_in_steady_motion_is_followed_to_its_speed(x, y, vx):
    point = PointFilter(x, y, 2.0, 500.0)
    for k in range(1, 60):
        point.predict(1 / 30)
        point.correct(x + vx * k / 30, y, 1.0)
    assert point.vx == pytest.approx(vx, abs=0.05 * abs(vx) + 1e-6)
    assert point.y == pytest.approx(y, abs=1e-6)


def test_uncertainty_grows_unseen_and_shrinks_when_seen():
    point = PointFilter(0, 0, 1.0, 300.0)
    point.predict(0.2)
    unseen = point.sigma_px
    assert unseen > 1.0
    point.correct(0, 0, 1.0)
    assert point.sigma_px < min(1.0, unseen)


def test_the_speed_is_bounded_and_a_point_found_again_is_at_rest():
    point = PointFilter(0, 0, 1.0, 3000.0)
    point.predict(1 / 30)
    point.correct(200, 0, 1.0)
    point.limit(100)
    assert point.vx == pytest.approx(100)
    point.restart(50, 60, 2.0)
    point.predict(1 / 30)
    assert (point.x, point.y) == (50, 60)
