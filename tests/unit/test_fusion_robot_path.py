"""Where the robot was when a frame was captured."""

from __future__ import annotations

import math

import pytest
from deixis_fusion.localisation import RobotPlace
from deixis_fusion.robot_path import RobotPath
from deixis_schemas.messages import RobotPose
from hypothesis import given
from hypothesis import strategies as st

START = 1_700_000_000.0


def pose(seconds: float, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> RobotPose:
    return RobotPose(stamp_ns=stamp(seconds), stage="robot", instance="r", x_m=x, y_m=y, yaw_deg=yaw)


def stamp(seconds: float) -> int:
    return int(START) * 10**9 + round(seconds * 1e9)


def path_of(*poses: RobotPose) -> RobotPath:
    path = RobotPath(max_age_s=1.0)
    for each in poses:
        path.hear(each)
    return path


def off_deg(first: float, second: float) -> float:
    return abs((first - second + 180) % 360 - 180)


def test_a_robot_that_turns_at_one_radian_per_second_is_placed_within_a_degree_at_a_frame_that_is_three_tenths_old() -> None:
    speed = math.degrees(1.0)
    path = path_of(*(pose(i / 10, yaw=speed * i / 10) for i in range(31)))
    fix = path.at(stamp(2.7 - 0.033))
    newest = path.newest
    assert newest is not None
    assert off_deg(newest.yaw_deg, speed * 2.667) > 17
    assert off_deg(fix.place.yaw_deg, speed * 2.667) < 1
    assert fix.doubt == ""


def test_between_two_poses_it_is_between_them_the_shorter_way_round() -> None:
    fix = path_of(pose(0, 1, 5, 170), pose(0.4, 2, 3, -170)).at(stamp(0.1))
    assert (fix.place.x_m, fix.place.y_m) == pytest.approx((1.25, 4.5))
    assert off_deg(fix.place.yaw_deg, 175) < 1e-6


def test_a_little_beyond_the_last_pose_it_moves_on_and_then_stands_where_it_said_last() -> None:
    path = path_of(pose(0, 0), pose(0.1, 0.1))
    assert path.at(stamp(0.25)).place.x_m == pytest.approx(0.25)
    assert path.at(stamp(0.31)).place.x_m == pytest.approx(0.1)
    assert path.at(stamp(0.31)).doubt == ""


def test_before_its_first_word_it_stands_there_and_before_any_at_the_start() -> None:
    path = RobotPath(max_age_s=1.0)
    path.start_at(RobotPlace(7, 8, 9))
    assert path.at(stamp(0)).place == RobotPlace(7, 8, 9)
    path.hear(pose(1, 3))
    assert path.at(stamp(0.5)).place.x_m == 3


def test_a_robot_that_publishes_on_change_stands_until_it_moves() -> None:
    path = path_of(pose(0, 1), pose(60, 2))
    assert path.at(stamp(59.9)).place.x_m == 1
    assert path.at(stamp(60.1)).place.x_m == 2


def test_an_old_pose_is_used_and_said_to_be_old() -> None:
    fix = path_of(pose(0, 1)).at(stamp(3.2))
    assert (fix.place.x_m, fix.doubt) == (1, "3.2 s older than the frame")


@pytest.mark.parametrize("frame_s", [-10.0, -START + 1])
def test_stamps_of_another_clock_are_not_compared_and_that_is_said(frame_s: float) -> None:
    fix = path_of(pose(0, 1), pose(0.1, 2)).at(stamp(frame_s))
    assert fix.place.x_m == 2
    assert "later than the frames'" in fix.doubt


def test_a_clock_that_is_set_back_forgets_the_poses_that_lie_in_the_future() -> None:
    path = path_of(pose(0, 0), pose(0.1, 1), pose(0.05, 2))
    assert path.at(stamp(0.05)).place.x_m == 2
    assert path.at(stamp(0.1)).place.x_m == pytest.approx(4)


def test_the_noise_of_poses_that_follow_each_other_closely_does_not_carry_it_away() -> None:
    path = path_of(*(pose(i / 1000, i / 1000 + (0.01 if i % 2 else 0)) for i in range(200)))
    assert path.at(stamp(0.399)).place.x_m == pytest.approx(0.399, abs=0.06)


def test_only_the_last_seconds_are_kept() -> None:
    path = path_of(*(pose(i / 50, i) for i in range(5000)))
    assert len(path._poses) <= 5 * 50 + 2


@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-360, 360)), min_size=1, max_size=30), st.floats(-30, 30))
def test_any_poses_and_any_time_give_a_place(told: list[tuple[float, float]], asked_s: float) -> None:
    place = path_of(*(pose(seconds, seconds, 0, yaw) for seconds, yaw in told)).at(stamp(asked_s)).place
    assert math.isfinite(place.x_m)
    assert math.isfinite(place.yaw_deg)
