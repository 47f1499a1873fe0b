"""Truth against plain projection, and against what `deixis eval` makes of it."""

from types import SimpleNamespace

import numpy as np
import pytest
from deixis_evaluation.clips import TrueCamera
from deixis_evaluation.truth_site import map_position
from deixis_simulation.bearings import azimuth_of
from deixis_simulation.geometry import RobotState, robot_at, to_world, view_at
from deixis_simulation.label_image import face_mask, hand_mask, region_of
from deixis_simulation.pixels import box_around, pixel
from deixis_simulation.scene import Camera, Person, Scene, ScenePoi, Waypoint
from deixis_simulation.skin_tone import skin_tone
from deixis_simulation.truth_arm import arm_truth, in_frame
from deixis_simulation.truth_camera import camera_truth, labels_origin, pose_truth, user_truth
from deixis_simulation.truth_head import head_truth, toward_camera_deg
from deixis_simulation.truth_meta import meta_truth, seed_and_index
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

METRES = st.floats(-2, 2)
PERSON = Person(avatar="nobody", place_m=(2.5, 0.4))
SCENE = Scene(duration_s=1, people=[PERSON], pois=[ScenePoi(poi_id="P1", position_m=(2.0, -1.0, 1.2))])


def cameras():
    return st.builds(
        Camera,
        horizontal_fov_deg=st.floats(50, 90),
        position_m=st.tuples(st.just(0.0), st.just(0.0), st.floats(0.6, 1.7)),
        pitch_up_deg=st.floats(-25, 25),
        roll_deg=st.floats(-10, 10),
    )


def turned(yaw_deg, pitch_deg=0.0):
    """World from a head that is turned to the picture's right and raised."""
    return Rotation.from_euler("YX", [yaw_deg, -pitch_deg], degrees=True).as_matrix()


def of_head(view, place, rotation):
    centre = to_world(place)
    return head_truth(rotation, centre, centre + rotation @ np.array([0, 0.02, 0.09]), view)


@given(camera=cameras(), x=st.floats(1, 4), y=METRES, z=st.floats(0, 2))
def test_labels_project_like_the_picture(camera, x, y, z):
    view, origin = view_at(camera, RobotState()), labels_origin(SCENE)
    pose = pose_truth(view, origin)
    point = to_world((x, y, z))
    seen = np.reshape(pose["R_world_to_cam"], (3, 3)) @ (point + origin) + pose["t_world_to_cam"]
    expected = view.matrix @ seen
    assert pixel(point, view) == pytest.approx(expected[:2] / max(expected[2], 0.1), abs=0.5)


@given(camera=cameras(), x=st.floats(1, 4), y=METRES, z=st.floats(0, 2))
def test_eval_has_pois_and_persons_where_the_scene_has_them(camera, x, y, z):
    scene = SCENE.model_copy(update={"camera": camera, "pois": [ScenePoi(poi_id="P1", position_m=(x, y, z))]})
    meta = meta_truth(scene, {})
    lens = TrueCamera.model_validate(meta["camera"])
    assert map_position(lens, tuple(meta["pois"][0]["xyz_world"])) == pytest.approx((x, y, z), abs=1e-3)
    user = user_truth(to_world((x, y, z)), view_at(camera, RobotState()), labels_origin(scene))
    assert user["robot_xy"] == pytest.approx((x, y), abs=2e-3)
    assert user["distance_m"] == pytest.approx(np.hypot(x, y), abs=2e-3)


def test_a_person_is_where_it_is_from_a_robot_that_has_moved():
    view = view_at(Camera(), robot_at([Waypoint(at_s=0), Waypoint(at_s=1, x_m=1.0, y_m=0.5, yaw_deg=90.0)], 2.0))
    user = user_truth(to_world((1.0, 2.5, 1.6)), view, labels_origin(SCENE))
    assert user["robot_xy"] == pytest.approx((2.0, 0.0), abs=1e-3)


@pytest.mark.parametrize("yaw_deg", [-100.0, -40.0, 0.0, 25.0, 130.0])
def test_yaw_is_positive_to_the_right_of_the_picture(yaw_deg):
    view = view_at(Camera(), RobotState())
    head = of_head(view, (2.0, 0.0, 1.3), turned(yaw_deg, 10.0))
    assert head["yaw_deg"] == pytest.approx(yaw_deg, abs=0.01)
    assert head["yaw_rel_deg"] == pytest.approx(yaw_deg, abs=0.01)
    assert head["pitch_deg"] == pytest.approx(10.0, abs=0.01)
    assert (head["eyes_px"][0] > head["center_px"][0]) == (yaw_deg > 0)


def test_yaw_to_the_camera_of_a_person_aside():
    """Who faces along the camera's axis from the left of the picture (y = 1) looks past the camera to the person's left."""
    view = view_at(Camera(horizontal_fov_deg=90), RobotState())
    head = of_head(view, (1.0, 1.0, 1.3), turned(0.0))
    assert head["yaw_deg"] == pytest.approx(0, abs=0.01)
    assert head["yaw_rel_deg"] == pytest.approx(-45, abs=0.01)
    assert head["center_px"][0] < view.width / 2


def test_a_camera_that_rolls_clockwise_sees_heads_lean_the_other_way():
    level, aslant = view_at(Camera(), RobotState()), view_at(Camera(roll_deg=10), RobotState())
    centre, top = to_world((2.0, 0.0, 1.3)), to_world((2.0, 0.0, 1.5))
    assert pixel(top, level)[0] == pytest.approx(pixel(centre, level)[0], abs=0.1)
    leans = np.degrees(
        np.arctan2(pixel(top, aslant)[0] - pixel(centre, aslant)[0], pixel(centre, aslant)[1] - pixel(top, aslant)[1])
    )
    head = of_head(aslant, (2.0, 0.0, 1.3), turned(0.0))
    assert head["roll_deg"] == pytest.approx(leans, abs=0.5)
    assert abs(head["roll_deg"]) == pytest.approx(10, abs=0.01)
    assert head["yaw_rel_deg"] == pytest.approx(0, abs=0.01)


def test_the_arm_points_where_the_poi_is():
    """A finger on the line from the shoulder to a POI has the azimuth that the scene's floor plan says."""
    view = view_at(Camera(), RobotState())
    shoulder, target = np.array([2.0, 0.0, 1.3]), np.array([1.5, -1.0, 1.1])
    at = {
        name: to_world(shoulder + share * (target - shoulder))
        for name, share in (("s", 0.0), ("e", 0.2), ("w", 0.4), ("t", 0.5))
    }
    moment = SimpleNamespace(
        arm_side="left",
        shoulder={"left": at["s"]},
        elbow={"left": at["e"]},
        wrist={"left": at["w"]},
        index_base={"left": at["w"]},
        fingertip={"left": at["t"]},
        eyes=at["s"],
    )
    arm = arm_truth(moment, toward_camera_deg(at["s"], view))
    expected = azimuth_of((2.0, 0.0), (0.0, 0.0), (1.5, -1.0))
    assert expected > 0
    for name in ("azimuth_deg", "forearm_azimuth_deg", "index_azimuth_deg", "eye_tip_azimuth_deg"):
        assert arm[name] == pytest.approx(expected, abs=0.01)
    assert arm["elevation_deg"] < 0
    assert arm_truth(SimpleNamespace(arm_side=None), 0.0) == {}


def test_points_behind_the_camera_stay_finite_and_out_of_frame():
    view = view_at(Camera(), RobotState())
    behind = to_world((-1.0, 0.0, 1.3))
    assert np.isfinite(pixel(behind, view)).all()
    assert not in_frame(behind, pixel(behind, view), view)
    assert in_frame(to_world((2.0, 0.0, 1.3)), pixel(to_world((2.0, 0.0, 1.3)), view), view)
    assert box_around(behind[None], view) is None


def test_regions_of_a_label_image():
    labels = np.zeros((8, 10), np.uint8)
    labels[1:3, 2:6] = 1 << 5 | 1 << 4 | 1
    labels[3, 2:6] = 1 << 5 | 1  # hair
    labels[5:7, 8:10] = 1 << 5 | 1 << 4 | 3
    labels[0, 0] = 1 << 4 | 1  # another person
    face = region_of(face_mask(labels, 1))
    assert (face.pixels, face.box, face.centroid) == (8, [2, 1, 4, 2], [3.5, 1.5])
    assert region_of(hand_mask(labels, 1, "right")).box == [8, 5, 2, 2]
    assert region_of(hand_mask(labels, 1, "left")).box is None
    assert region_of(face_mask(labels, 0)).pixels == 1


@pytest.mark.parametrize(("bgr", "dark"), [((60, 80, 110), True), ((170, 190, 225), False)])
def test_skin_tone_tells_dark_from_light(bgr, dark):
    picture = np.full((10, 10, 3), bgr, np.uint8)
    tone = skin_tone(picture, np.ones((10, 10), bool))
    assert (tone["face_ITA_deg"] < 10) == dark
    assert skin_tone(picture, np.zeros((10, 10), bool)) == {}


def test_meta_says_where_a_clip_comes_from():
    assert seed_and_index(SCENE.model_copy(update={"name": "s2000_012_point"})) == (2000, 12)
    assert seed_and_index(SCENE.model_copy(update={"name": "farther"})) == (None, None)
    meta = meta_truth(SCENE, {0: {"face_ITA_deg": 20.0}})
    assert Scene.model_validate(meta["scene"]) == SCENE
    assert meta["persons"][0]["face_ITA_deg"] == 20.0
    assert camera_truth(SCENE, view_at(SCENE.camera, RobotState()), labels_origin(SCENE)).keys() >= {"roll_deg", "pitch_up_deg"}
