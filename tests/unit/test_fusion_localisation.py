"""Where persons are, what they see, and at which bearing."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from deixis_evaluation.clips import TrueCamera
from deixis_evaluation.truth_site import map_position
from deixis_fusion.discernment import candidates
from deixis_fusion.localisation import (
    DistanceFilter,
    HeadSighting,
    PersonPlace,
    RobotPlace,
    bearing_deg,
    bearing_sigma_deg,
    depth_of_face,
    locate,
    viewing_ray,
)
from deixis_fusion.visibility import sees
from deixis_schemas.messages import CameraInfo, CameraMount, Poi
from hypothesis import given
from hypothesis import strategies as st

SHIPPED = Path(__file__).resolve().parents[2] / "examples" / "clips"
CLIPS = ("pointing", "small", "two_persons")
K = (560.0, 0.0, 319.5, 0.0, 560.0, 239.5, 0.0, 0.0, 1.0)
angles = st.floats(-179, 179)
metres = st.floats(-20, 20)


def camera(**changes: Any) -> CameraInfo:
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


def test_the_distance_of_a_face_scales_with_the_picture() -> None:
    assert depth_of_face(camera(), 50.96, 640, 0.182) == pytest.approx(2.0)
    assert depth_of_face(camera(), 25.48, 320, 0.182) == pytest.approx(2.0)
    with pytest.raises(ValueError, match="width_px"):
        depth_of_face(camera(), 0, 640, 0.182)


def test_without_intrinsics_nobody_is_placed() -> None:
    with pytest.raises(ValueError, match="camera_matrix"):
        depth_of_face(camera(camera_matrix=None), 50, 640, 0.182)


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [
        ("plumb_bob", [-0.28, 0.09, 0.001, -0.0005, 0.0]),
        ("rational_polynomial", [0.1, -0.05, 0.0005, 0.0002, 0.01, 0.12, -0.03, 0.005]),
        ("equidistant", [0.02, -0.005, 0.001, 0.0]),
    ],
)
def test_distortion_is_taken_back_as_opencv_does(model: str, coefficients: list[float]) -> None:
    import cv2

    matrix, lens = np.array(K).reshape(3, 3), np.array(coefficients)
    for pixel in [(40.0, 30.0), (319.5, 239.5), (600.0, 400.0)]:
        points = np.array([[pixel]])
        theirs = (cv2.fisheye if model == "equidistant" else cv2).undistortPoints(points, matrix, lens)
        ours = viewing_ray(camera(distortion_model=model, distortion=coefficients), pixel, (640, 480))
        assert ours == pytest.approx(tuple(theirs.ravel()), abs=2e-3)


def test_an_uncertain_distance_blurs_what_lies_to_the_side_and_not_what_lies_ahead() -> None:
    beside, ahead = bearing_sigma_deg(place(2, 0), (2, -1, 1), 0.0), bearing_sigma_deg(place(2, 0), (1, 0, 1), 0.0)
    assert beside == pytest.approx(math.degrees(math.atan(0.1)), rel=0.01)
    assert ahead == pytest.approx(0, abs=1e-6)


def test_a_turned_head_hardly_changes_the_distance() -> None:
    distance = DistanceFilter(0.7)
    assert distance.update(2.0, 0.0, frontal=True) == 2.0
    for _ in range(30):
        turned = distance.update(2.4, 1 / 30, frontal=False)
    assert turned < 2.08
    for _ in range(90):
        frontal = distance.update(2.4, 1 / 30, frontal=True)
    assert frontal == pytest.approx(2.4, rel=0.02)


# --- walls ------------------------------------------------------------------------------------------------------------

WALL = ((1.0, -1.0), (1.0, 1.0))


def test_a_wall_hides_what_lies_behind_it() -> None:
    assert not sees((0, 0), (2, 0), [WALL])
    assert sees((0, 0), (2, 3), [WALL])
    assert sees((2, 1), (3, 0), [WALL])


def test_a_poi_that_hangs_on_a_wall_is_seen() -> None:
    assert sees((0, 0), (1.0, 0.2), [WALL])
    assert sees((0, 0), (1.1, 0.0), [WALL])


def test_a_ray_through_the_corner_of_two_walls_is_blocked() -> None:
    assert not sees((0, 0), (2, 2), [((1, 1), (1, 3)), ((1, 1), (3, 1))])


@given(metres, metres, metres, metres)
def test_sight_is_mutual(ax: float, ay: float, bx: float, by: float) -> None:
    assert sees((ax, ay), (bx, by), [WALL], 0.0) == sees((bx, by), (ax, ay), [WALL], 0.0)


def test_the_frame_of_discernment_holds_the_visible_pois_by_id() -> None:
    pois = [
        Poi(poi_id="b", position_m=(2.5, 0, 1)),
        Poi(poi_id="a", position_m=(0, 2, 1)),
        Poi(poi_id="c", position_m=(0, 1, 1)),
    ]
    found = candidates(place(0.5, 0), pois, [WALL], 0.15)
    assert [candidate.poi.poi_id for candidate in found] == ["a", "c"]


# --- the shipped clips' truth -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CLIPS)
def test_bearings_of_the_pois_of_a_clip_match_its_truth_within_a_degree(name: str) -> None:
    truth = json.loads((SHIPPED / f"{name}.json").read_text())
    meta, lens = truth["meta"], TrueCamera.model_validate(truth["meta"]["camera"])
    mount = CameraMount(position_m=(0.0, 0.0, lens.height_m), pitch_up_deg=lens.pitch_up_deg)
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
