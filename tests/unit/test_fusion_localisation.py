"""Where persons are, what they see, and at which bearing."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from deixis_evaluation.camera_pose import mount_of
from deixis_evaluation.clips import TrueCamera
from deixis_evaluation.truth_site import map_position
from deixis_fusion.config import PlaceConfig
from deixis_fusion.localisation import (
    Camera,
    DistanceFilter,
    HeadSighting,
    PersonLocator,
    PersonPlace,
    RobotPlace,
    bearing_deg,
    depth_of_face,
    locate,
)
from deixis_runtime.lens import LensError
from deixis_runtime.mount import to_base
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import CameraInfo, CameraMount, HeadPose, Track
from hypothesis import given
from hypothesis import strategies as st

SHIPPED = Path(__file__).resolve().parents[2] / "examples" / "clips"
CLIPS = ("pointing", "small", "two_persons")
K = (560.0, 0.0, 319.5, 0.0, 560.0, 239.5, 0.0, 0.0, 1.0)
angles = st.floats(-179, 179)
metres = st.floats(-20, 20)


def camera_info(**changes: Any) -> CameraInfo:
    content = {
        "stamp_ns": 0,
        "stage": "camera",
        "instance": "i",
        "state": "streaming",
        "source": "",
        "width": 640,
        "height": 480,
    }
    return CameraInfo.model_validate(content | {"camera_matrix": K} | changes)


def camera(**changes: Any) -> Camera:
    return Camera.of(camera_info(**changes))


def place(x: float, y: float) -> PersonPlace:
    """A person at x, y, with the camera at the map's origin."""
    return PersonPlace((x, y, 1.5), (0.0, 0.0, 1.3), math.hypot(x, y), 0.1)


def test_bearings_are_positive_toward_the_image_right_which_is_the_persons_own_left() -> None:
    # The camera looks along x; the image's right is -y.
    assert bearing_deg(place(2, 0), (2, -1, 1)) == pytest.approx(90)
    assert bearing_deg(place(2, 0), (2, 1, 1)) == pytest.approx(-90)
    assert bearing_deg(place(2, 0), (0, 0, 1)) == pytest.approx(0)
    assert abs(bearing_deg(place(2, 0), (4, 0, 1))) == pytest.approx(180)


@given(metres, metres, angles, angles, angles)
def test_the_bearing_does_not_depend_on_where_the_robot_stands_in_the_map(
    x: float, y: float, robot_yaw: float, mount_yaw: float, poi_angle: float
) -> None:
    info = camera(mount=CameraMount(position_m=(0.2, -0.1, 1.3), yaw_deg=mount_yaw, pitch_up_deg=4))
    head = HeadSighting((400.0, 200.0), (640, 480), 2.0)
    found = locate(info, RobotPlace(x, y, robot_yaw), head, 0.05)
    # A POI one metre from the person, at a known angle from the direction to the camera, counter-clockwise.
    toward = math.atan2(found.camera_m[1] - found.position_m[1], found.camera_m[0] - found.position_m[0])
    direction = toward + math.radians(poi_angle)
    poi = (found.position_m[0] + math.cos(direction), found.position_m[1] + math.sin(direction), 1.0)
    assert bearing_deg(found, poi) == pytest.approx(poi_angle, abs=1e-6)


def test_a_camera_that_is_turned_and_tilted_sees_what_lies_ahead_of_it() -> None:
    info = camera(mount=CameraMount(position_m=(0.0, 0.0, 1.0), yaw_deg=90, pitch_up_deg=45))
    found = locate(info, RobotPlace(1.0, 1.0, 0.0), HeadSighting((319.5, 239.5), (640, 480), 2.0), 0.05)
    assert found.position_m == pytest.approx((1.0, 1.0 + math.sqrt(2), 1.0 + math.sqrt(2)))


def rotation(axis: int, degrees: float) -> np.ndarray:
    """The matrix of a turn about an axis of a right-handed frame."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    matrix = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix[first, first] = matrix[second, second] = cos
    matrix[first, second], matrix[second, first] = -sin, sin
    return matrix


@given(angles, angles, angles, st.tuples(metres, metres, metres))
def test_the_mount_turns_as_rotation_matrices_do(
    roll: float, pitch_up: float, yaw: float, optical: tuple[float, float, float]
) -> None:
    # REP-103: x forward, y left, z up; right-handed about x is clockwise seen from behind, about y is down.
    turn = rotation(2, yaw) @ rotation(1, -pitch_up) @ rotation(0, roll)
    expected = turn @ np.array([optical[2], -optical[0], -optical[1]])
    found = to_base(optical, CameraMount(roll_deg=roll, pitch_up_deg=pitch_up, yaw_deg=yaw))
    assert found == pytest.approx(tuple(expected), abs=1e-9)


def test_a_camera_rolled_clockwise_sees_what_is_above_on_the_left_of_its_picture() -> None:
    _, left, up = to_base((-1.0, 0.0, 0.0), CameraMount(roll_deg=90))
    assert (left, up) == pytest.approx((0, 1))


def test_the_distance_of_a_face_scales_with_the_picture() -> None:
    lens = camera().lens
    assert depth_of_face(lens, 280 * FACE_WIDTH_M, (640, 480)) == pytest.approx(2.0)
    assert depth_of_face(lens, 140 * FACE_WIDTH_M, (320, 240)) == pytest.approx(2.0)


@pytest.mark.parametrize("matrix", [None, (0.0, *K[1:]), (-560.0, *K[1:]), (*K[:4], 1e-300, *K[5:]), (1e300, *K[1:])])
def test_a_camera_without_intrinsics_that_can_be_places_nobody(matrix: tuple[float, ...] | None) -> None:
    with pytest.raises(LensError, match="camera_matrix"):
        Camera.of(camera_info(camera_matrix=matrix))


def face(width: float) -> Track:
    return Track.model_validate(
        {"track_id": 1, "person_id": 1, "kind": "face", "kind_probabilities": {"face": 1}, "centroid_px": (320, 240)}
        | {"bbox_px": (320 - width / 2, 215, width, 60), "velocity_px_s": (0, 0)}
    )


def test_a_person_is_as_far_away_as_its_head_says_where_it_was_read() -> None:
    """A box around hair, half as wide again, puts a person a third nearer."""
    read = HeadPose(person_id=1, status="tracking", yaw_deg=80, yaw_sigma_deg=3, face_width_px=46)
    lost, blind = HeadPose(person_id=1, status="lost"), HeadPose(person_id=1, status="tracking", yaw_deg=80, yaw_sigma_deg=3)
    far = {}
    for name, pose in (("read", read), ("lost", lost), ("blind", blind)):
        locator = PersonLocator(PlaceConfig())
        locator.see(face(69), (640, 480), pose, (camera(), RobotPlace()), 0)
        assert locator.place is not None
        far[name] = locator.place.distance_m
    assert far["read"] == pytest.approx(1.5 * far["lost"], rel=0.01)
    assert far["blind"] == pytest.approx(far["lost"])


def test_a_place_beyond_what_a_message_can_say_is_none() -> None:
    locator = PersonLocator(PlaceConfig())
    locator.see(face(46), (640, 480), None, (camera(), RobotPlace(99_999.0, 0, 0)), 0)
    assert locator.place is None
    locator.see(face(46), (640, 480), None, (camera(), RobotPlace()), 1)
    assert locator.place is not None


def test_a_place_is_held_for_a_while_when_the_face_is_not_seen() -> None:
    locator = PersonLocator(PlaceConfig())
    locator.see(face(46), (640, 480), None, (camera(), RobotPlace()), 0)
    for seconds, held in ((1.9, True), (2.1, False)):
        locator.see(None, (640, 480), None, (camera(), RobotPlace()), int(seconds * 1e9))
        assert (locator.place is not None) is held


def test_a_turned_head_hardly_changes_the_distance() -> None:
    distance = DistanceFilter(0.7)
    assert distance.update(2.0, 0.0, frontal=True) == 2.0
    for _ in range(30):
        turned = distance.update(2.4, 1 / 30, frontal=False)
    assert turned < 2.08
    for _ in range(90):
        frontal = distance.update(2.4, 1 / 30, frontal=True)
    assert frontal == pytest.approx(2.4, rel=0.02)


# --- the shipped clips' truth -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CLIPS)
def test_bearings_of_the_pois_of_a_clip_match_its_truth_within_a_degree(name: str) -> None:
    truth = json.loads((SHIPPED / f"{name}.json").read_text())
    meta, lens = truth["meta"], TrueCamera.model_validate(truth["meta"]["camera"])
    mount = mount_of(lens)
    size = (meta["width"], meta["height"])
    info = camera(camera_matrix=lens.matrix, mount=mount, width=size[0], height=size[1])
    pois = {poi["id"]: map_position(lens, poi["xyz_world"]) for poi in meta["pois"]}
    errors = []
    for frame in truth["frames"]:
        for person in frame["persons"]:
            if person["phase"] != "stroke":
                continue
            head = HeadSighting(tuple(person["head"]["center_px"]), size, person["head"]["center_cam"][2])
            found = locate(info, RobotPlace(), head, 0.05)
            assert found.position_m[:2] == pytest.approx(person["user_pos"]["robot_xy"], abs=0.03)
            errors.append(abs(bearing_deg(found, pois[person["poi"]]) - person["poi_azimuth_deg"]))
    assert errors
    assert max(errors) < 1.0
