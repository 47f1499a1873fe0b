"""Rehearsal: from a site to places, aims and scenes, in the robot's frame."""

import math
from pathlib import Path

import pytest
import yaml
from deixis_runtime.site import load_site
from deixis_simulation.geometry import RobotState, view_at
from deixis_simulation.rehearsal.aims import aims_of, close_pairs, face_px
from deixis_simulation.rehearsal.ground import RehearsalError, RobotFrame, ground_of
from deixis_simulation.rehearsal.places import chosen_places, given_places, in_picture
from deixis_simulation.rehearsal.trials import TURNED_FROM_DEG, plan_trials
from hypothesis import given
from hypothesis import strategies as st

AVATARS = ("one", "two", "three")
LAMP = {"poi_id": "lamp", "name": "the lamp", "position_m": [2.0, 1.5, 1.2]}
VASE = {"poi_id": "vase", "name": "the vase", "position_m": [2.0, -1.5, 1.2]}


def site(folder: Path, **content: object):
    path = folder / "site.yaml"
    path.write_text(yaml.safe_dump({"pois": [LAMP, VASE], **content}))
    return load_site(path)


def calibration(folder: Path, distortion: float) -> None:
    matrix = [800.0, 0.0, 959.5, 0.0, 800.0, 539.5, 0.0, 0.0, 1.0]
    content = {
        "image_width": 1920,
        "image_height": 1080,
        "camera_matrix": {"rows": 3, "cols": 3, "data": matrix},
        "distortion_model": "plumb_bob",
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": [distortion, 0, 0, 0, 0]},
    }
    (folder / "camera.yaml").write_text(yaml.safe_dump(content))


coordinates = st.floats(-50, 50)


@given(coordinates, coordinates, st.floats(-360, 360), coordinates, coordinates)
def test_robot_frame_goes_there_and_back(x: float, y: float, yaw: float, px: float, py: float) -> None:
    frame = RobotFrame(x, y, yaw)
    assert frame.to_map(frame.of_map((px, py))) == pytest.approx((px, py), abs=1e-9)


def test_pois_and_walls_are_seen_from_the_robot(tmp_path: Path) -> None:
    turned = site(tmp_path, robot_pose={"x_m": 1.0, "y_m": 2.0, "yaw_deg": 90}, walls=[[[1.0, 4.0], [2.0, 4.0]]])
    ground = ground_of(turned)
    # The lamp is 1 m to the map's right of the robot, which looks along the map's y: to its right, and half a metre back.
    assert ground.pois[0].position_m == pytest.approx((-0.5, -1.0, 1.2))
    assert ground.walls[0] == (pytest.approx((2.0, 0.0)), pytest.approx((2.0, -1.0)))


def test_camera_is_as_wide_as_the_assumed_lens(tmp_path: Path) -> None:
    ground = ground_of(site(tmp_path, camera={"horizontal_fov_deg": 75, "mount": {"roll_deg": 3, "pitch_up_deg": 5}}))
    assert ground.camera.horizontal_fov_deg == pytest.approx(75)
    assert (ground.camera.roll_deg, ground.camera.pitch_up_deg) == (3, 5)
    assert ground.pinhole_px is None
    assert ground.notes == ()


@pytest.mark.parametrize(("distortion", "replaced"), [(0.0, False), (-0.3, True)])
def test_calibrated_camera_keeps_its_focal_length_and_the_size_that_the_stages_see(
    tmp_path: Path, distortion: float, replaced: bool
) -> None:
    calibration(tmp_path, distortion)
    ground = ground_of(site(tmp_path, camera={"calibration": "camera.yaml", "max_width": 1280}))
    assert (ground.camera.width, ground.camera.height) == (1280, 720)
    assert ground.camera.focal_px == pytest.approx(800 * 1280 / 1920, rel=1e-4)
    assert (ground.pinhole_px is not None) is replaced
    assert bool(ground.notes) is replaced


def test_fisheye_is_drawn_as_wide_as_can_be_and_said(tmp_path: Path) -> None:
    ground = ground_of(site(tmp_path, camera={"horizontal_fov_deg": 150}))
    assert ground.camera.horizontal_fov_deg == 120
    assert "150 degrees" in ground.notes[0]
    assert ground.pinhole_px == pytest.approx(ground.camera.focal_px)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"pois": []}, "nothing to point at"),
        ({"camera": {"sorce": "0"}}, "sorce"),
        ({"camera": {"calibration": "missing.yaml"}}, "missing.yaml"),
        ({"camera": {"mount": {"pitch_up_deg": 85}}}, "camera.mount"),
        ({"pois": [{"poi_id": "moon", "position_m": [1000, 0, 0]}]}, "beyond 60 m"),
    ],
)
def test_site_that_cannot_be_rehearsed_says_why(tmp_path: Path, content: dict[str, object], words: str) -> None:
    with pytest.raises(RehearsalError, match=words):
        ground_of(site(tmp_path, **content))


def test_chosen_places_are_in_the_picture_apart_and_clear_of_pois(tmp_path: Path) -> None:
    ground = ground_of(site(tmp_path, walls=[[[-1.0, 0.4], [4.0, 0.4]]]))
    places = chosen_places(ground, 4)
    view = view_at(ground.camera, RobotState())
    assert [place.letter for place in places] == ["A", "B", "C", "D"][: len(places)]
    for place in places:
        assert in_picture(view, place.position_m, 0.6)
        assert place.position_m[1] < 0.4 - 0.35, "the wall hides what is beyond it"
        assert 1.1 <= math.dist(place.position_m, ground.camera_foot) <= 3.5


def test_no_place_where_the_camera_looks_at_the_ceiling(tmp_path: Path) -> None:
    with pytest.raises(RehearsalError, match="pitch_up_deg"):
        chosen_places(ground_of(site(tmp_path, camera={"mount": {"pitch_up_deg": 55}})), 3)


@pytest.mark.parametrize(
    ("point", "words"),
    [((0.5, 0.0), "0.5 m from the camera"), ((2.0, 2.0), "not in the picture"), ((3.0, 0.0), "wall"), ((2.4, 0.0), "a wall")],
)
def test_given_place_that_cannot_be_says_why(tmp_path: Path, point: tuple[float, float], words: str) -> None:
    ground = ground_of(site(tmp_path, walls=[[[2.5, -1.0], [2.5, 1.0]]]))
    with pytest.raises(RehearsalError, match=words):
        given_places(ground, [point])


def test_aims_tell_bearing_wall_back_and_hand(tmp_path: Path) -> None:
    pois = [
        LAMP,
        {"poi_id": "hidden", "position_m": [2.0, -3.0, 1.2]},
        {"poi_id": "back", "position_m": [4.0, 0.1, 1.2]},
        {"poi_id": "robot", "position_m": [-0.5, 0.0, 1.2]},
    ]
    ground = ground_of(site(tmp_path, pois=pois, walls=[[[0.0, -2.0], [4.0, -2.0]]]))
    aims = {aim.poi.poi_id: aim for aim in aims_of(ground, given_places(ground, [(2.0, 0.0)]))}
    # Facing the robot, the map's left is the person's right.
    assert aims["lamp"].azimuth_deg == pytest.approx(-90)
    assert aims["lamp"].hidden is None
    assert aims["lamp"].hand_in_picture
    assert aims["hidden"].hidden == "wall"
    assert aims["back"].hidden == "behind"
    assert aims["robot"].toward_camera


def test_hand_leaves_a_narrow_picture(tmp_path: Path) -> None:
    for fov, inside in ((60, False), (90, True)):
        ground = ground_of(site(tmp_path, camera={"horizontal_fov_deg": fov}))
        aims = {aim.poi.poi_id: aim for aim in aims_of(ground, given_places(ground, [(1.4, 0.4)]))}
        assert aims["lamp"].hand_in_picture is inside


def test_close_pairs_come_closest_first(tmp_path: Path) -> None:
    pois = [{"poi_id": name, "position_m": [2.0, y, 1.2]} for name, y in (("a", 1.0), ("b", 1.1), ("c", -1.0))]
    pois += [{"poi_id": "d", "position_m": [1.8, 1.5, 1.2]}]
    ground = ground_of(site(tmp_path, pois=pois))
    pairs = close_pairs(aims_of(ground, given_places(ground, [(2.0, 0.0)])))
    assert [(pair.first.poi_id, pair.second.poi_id) for pair in pairs] == [("a", "b"), ("a", "d"), ("b", "d")]
    assert [pair.gap_deg for pair in pairs] == sorted(pair.gap_deg for pair in pairs)


def test_a_face_is_narrower_farther_off(tmp_path: Path) -> None:
    ground = ground_of(site(tmp_path))
    near, far = given_places(ground, [(1.5, 0.0), (3.0, 0.0)])
    assert face_px(ground, near) > 1.8 * face_px(ground, far)


def test_trials_are_the_same_again_and_differ_by_seed(tmp_path: Path) -> None:
    ground = ground_of(site(tmp_path))
    aims = aims_of(ground, chosen_places(ground, 2))
    first = plan_trials(ground, aims, count=2, seed=1, avatars=AVATARS)
    assert first == plan_trials(ground, aims, count=2, seed=1, avatars=AVATARS)
    assert first != plan_trials(ground, aims, count=2, seed=2, avatars=AVATARS)
    # One more person each leaves the first ones as they were, so that their clips serve again.
    assert first[:6] == plan_trials(ground, aims, count=3, seed=1, avatars=AVATARS)[:6]
    assert len({trial.scene.name for trial in first}) == len(first)
    assert len(first) == 2 * 2 * 2 + 2


def test_scenes_hold_the_site_and_who_points(tmp_path: Path) -> None:
    ground = ground_of(site(tmp_path, walls=[[[5.0, -2.0], [5.0, 2.0]]]))
    aims = aims_of(ground, chosen_places(ground, 1))
    trials = plan_trials(ground, aims, count=1, seed=1, avatars=AVATARS)
    assert [trial.scene.kind for trial in trials] == ["point", "point", "quiet"]
    for trial in trials:
        scene = trial.scene
        assert [poi.poi_id for poi in scene.pois] == ["lamp", "vase"]
        assert scene.camera == ground.camera
        assert scene.room.front_x_m > 5.0
        assert scene.room.walls == [((5.0, -2.0), (5.0, 2.0))]
        assert scene.people[0].place_m == trial.place.position_m
        assert scene.duration_s > scene.people[0].actions[-1].end_s
    assert trials[0].scene.people[0].actions[0].poi == "lamp"
    assert trials[1].scene.pois[1].exhibit == "vase"


def test_people_turn_toward_what_is_far_to_the_side(tmp_path: Path) -> None:
    ground = ground_of(site(tmp_path, pois=[{"poi_id": "far", "position_m": [3.5, 1.0, 1.2]}]))
    aims = aims_of(ground, given_places(ground, [(2.0, 0.0)]))
    beyond = abs(aims[0].azimuth_deg) - TURNED_FROM_DEG
    assert beyond > 30
    person = plan_trials(ground, aims, count=1, seed=1, avatars=AVATARS)[0].scene.people[0]
    # Facing the camera is heading 180; the POI is to the person's right.
    assert person.heading_deg == pytest.approx(180 - beyond, abs=15.1)
