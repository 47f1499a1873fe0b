"""Angles from meshes, what is said of a head look by look, and which tracks are answered."""

import math

import numpy as np
import pytest
from deixis_headpose_mediapipe.angles import GENERIC_HEAD_MM, sigma_deg, yaw_of
from deixis_headpose_mediapipe.config import HeadposeConfig
from deixis_headpose_mediapipe.head import Head
from deixis_headpose_mediapipe.joining import Joiner
from deixis_runtime.lens import Pinhole
from deixis_schemas.messages import Frame, Tracks

LENS = Pinhole(560.0, 319.5, 239.5)
CONFIG = HeadposeConfig()


def mesh_of(yaw_deg, aside_m=0.0, distance_m=2.0, roll_deg=0.0):
    """The mesh of the generic head turned by so much from the line to the camera, as the model would tell it."""
    line = math.atan2(-aside_m, math.sqrt(distance_m**2 - aside_m**2))
    turn, roll = math.radians(yaw_deg) + line, math.radians(roll_deg)
    head = np.array(list(GENERIC_HEAD_MM.values())) / 1e3
    head = head @ np.array([[math.cos(roll), math.sin(roll), 0], [-math.sin(roll), math.cos(roll), 0], [0, 0, 1]])

    def turned(angle):
        about_y = np.array([[math.cos(angle), 0, -math.sin(angle)], [0, 1, 0], [math.sin(angle), 0, math.cos(angle)]])
        return head @ about_y.T

    seen = turned(turn) + np.array([aside_m, 0, math.sqrt(distance_m**2 - aside_m**2)])
    pixels = LENS.focal_px * seen[:, :2] / seen[:, 2:] + (LENS.centre_x_px, LENS.centre_y_px)
    mesh = np.zeros((478, 3))
    mesh[list(GENERIC_HEAD_MM)] = np.column_stack([pixels, turned(math.radians(yaw_deg))[:, 2] * LENS.focal_px / distance_m])
    # What spans the mesh's own axes is relative to the line of sight already.
    for index in (33, 263, 10, 152):
        place = list(GENERIC_HEAD_MM).index(index)
        mesh[index, :2] = turned(math.radians(yaw_deg))[place, :2] * LENS.focal_px / distance_m + pixels.mean(axis=0)
    return mesh


@pytest.mark.parametrize("yaw_deg", [-55, -30, 0, 20, 55])
@pytest.mark.parametrize("aside_m", [-0.7, 0.0, 0.7])
def test_the_yaw_is_relative_to_the_line_to_the_camera(yaw_deg, aside_m):
    found = yaw_of(mesh_of(yaw_deg, aside_m), LENS)
    assert found == pytest.approx(yaw_deg, abs=8)
    assert math.copysign(1, found) == math.copysign(1, yaw_deg) or abs(yaw_deg) < 5


def test_a_mesh_on_its_side_or_of_one_point_is_no_head():
    assert yaw_of(mesh_of(0, roll_deg=80), LENS) is None
    assert yaw_of(np.zeros((478, 3)), LENS) is None


def test_the_sigma_grows_with_the_yaw():
    assert sigma_deg(0) < sigma_deg(-40) < sigma_deg(60)


def said(head, *yaws):
    return [head.look(yaw) for yaw in yaws]


def test_a_yaw_is_told_when_two_looks_agree():
    poses = said(Head(3, CONFIG), 10.0, 11.0, 12.0)
    assert [pose.status for pose in poses] == ["initialising", "tracking", "tracking"]
    assert poses[-1].person_id == 3


def test_a_mesh_that_comes_back_from_a_profile_is_not_believed_at_once():
    poses = said(Head(0, CONFIG), 50.0, 52.0, None, None, 3.0, 47.0, 46.0)
    assert [pose.status for pose in poses] == ["initialising", "tracking", "lost", "lost", "lost", "lost", "tracking"]
    assert poses[-1].yaw_deg == 46.0


@pytest.mark.parametrize(("yaw_deg", "side"), [(70.0, "left"), (-70.0, "right")])
def test_beyond_its_range_the_side_alone_is_told(yaw_deg, side):
    pose = said(Head(0, CONFIG), yaw_deg, yaw_deg)[-1]
    assert (pose.status, pose.side, pose.yaw_deg, pose.beyond_deg) == ("out_of_range", side, None, CONFIG.reach_deg)


def frame(seq, run=1):
    content = {"width": 2, "height": 1, "encoding": "mono8", "data": b"ab"}
    return Frame(run=run, seq=seq, stamp_ns=seq, stage="camera", instance="c", **content)


def tracks(seq, run=1):
    return Tracks(run=run, seq=seq, stamp_ns=seq, stage="tracker", instance="t", width=2, height=1)


def test_the_newest_tracks_whose_frame_is_here_are_answered_once():
    joiner = Joiner(4)
    joiner.add([frame(1), frame(2), frame(3)], [tracks(1), tracks(2)])
    pair = joiner.take()
    assert (pair[0].seq, pair[1].seq) == (2, 2)
    assert joiner.take() is None
    joiner.add([], [tracks(1)])
    assert joiner.take() is None, "its frame went with the older ones"
    joiner.add([], [tracks(3)])
    assert joiner.take()[0].seq == 3


def test_tracks_wait_for_their_frame_and_no_more_than_set_do():
    joiner = Joiner(3)
    joiner.add([], [tracks(seq) for seq in range(10)])
    assert joiner.waits.seq == 9
    joiner.add([frame(seq) for seq in range(9)], [])
    assert joiner.take()[1].seq == 8


def test_a_camera_that_begins_anew_is_answered():
    joiner = Joiner(3)
    joiner.add([frame(9)], [tracks(9)])
    joiner.take()
    joiner.add([frame(0, run=2)], [tracks(0, run=2)])
    assert joiner.take()[0].run == 2
