"""Scenes drawn at random: all that is said to vary does, and the same seed and index are the same scene."""

import math
from collections import Counter
from itertools import pairwise

import pytest
from deixis_simulation import framing
from deixis_simulation.avatars import FITTING_AVATARS, HELD_OUT_AVATARS
from deixis_simulation.bearings import azimuth_of, heading_to, off_line_m, place_at
from deixis_simulation.command import drawn_scenes
from deixis_simulation.draw import draw_scene
from deixis_simulation.draw_layout import DrawingError
from deixis_simulation.draw_lens import SIZES, Overrides
from deixis_simulation.draw_room import SKIN_LIKE
from deixis_simulation.geometry import robot_at, to_world, view_at, wrap_deg
from deixis_simulation.scene import KINDS, QUIET_GESTURES, HeadTurn, Pointing, Quiet, Scene, Walk, dump_scene, load_scene
from hypothesis import given, settings
from hypothesis import strategies as st

CAMERA = (0.0, 0.0)


@pytest.fixture(scope="module")
def scenes():
    return [draw_scene(3000 + number // 100, number % 100) for number in range(500)]


def actions(scenes, kind):
    return [action for scene in scenes for person in scene.people for action in person.actions if isinstance(action, kind)]


def share(scenes, holds):
    return sum(map(holds, scenes)) / len(scenes)


def covers(values, low, high):
    """All within, and nearly to both ends."""
    values = sorted(values)
    slack = 0.1 * (high - low)
    return low <= values[0] <= low + slack and high - slack <= values[-1] <= high


def stand_of(person):
    return next((action.to_m for action in person.actions if isinstance(action, Walk)), person.place_m)


def test_kinds_come_by_weight(scenes):
    counts = Counter(scene.kind for scene in scenes)
    assert set(counts) == set(KINDS)
    assert 0.38 < counts["point"] / 500 < 0.52
    assert 0.14 < counts["quiet"] / 500 < 0.26


def test_people_differ(scenes):
    people = [person for scene in scenes for person in scene.people]
    assert covers([person.height_m for person in people], 1.2, 2.0)
    assert {person.avatar for person in people} == set(HELD_OUT_AVATARS)
    assert Counter(len(scene.people) for scene in scenes).keys() == {0, 1, 2, 3}
    assert len({person.skin_tint for person in people}) > 100
    assert len({person.clothes_tint for person in people}) > 100


def test_lens_camera_and_sensor_vary(scenes):
    cameras = [scene.camera for scene in scenes]
    assert {(camera.width, camera.height) for camera in cameras} == set(SIZES)
    assert covers([camera.horizontal_fov_deg for camera in cameras], 50, 90)
    assert covers([camera.position_m[2] for camera in cameras], 0.6, 1.7)
    assert {camera.pitch_up_deg // 8 for camera in cameras} > {-2, -1, 0, 1}
    assert covers([camera.roll_deg for camera in cameras], -9, 9)
    sensors = [scene.sensor for scene in scenes]
    for low, high, values in (
        (0.4, 3.5, [sensor.noise for sensor in sensors]),
        (0.4, 1.4, [sensor.blur_px for sensor in sensors]),
        (16, 32, [sensor.quality_crf for sensor in sensors]),
    ):
        assert covers(values, low, high)
    assert covers([sensor.white_balance[0] for sensor in sensors], 0.84, 1.16)


def test_rooms_and_light_vary(scenes):
    assert {scene.room.wall for scene in scenes} == {"plaster", "brick", "wood", "panel"}
    assert {scene.room.floor for scene in scenes} == {"wood", "stone", "carpet"}
    assert share(scenes, lambda scene: scene.room.wall_tone in SKIN_LIKE) > 0.25
    assert {scene.light.preset for scene in scenes} == {"office", "window_left", "window_right", "warm", "hard"}
    assert 0.1 < share(scenes, lambda scene: bool(scene.light.changes)) < 0.5
    assert 0.05 < share(scenes, lambda scene: scene.light.flicker_depth > 0) < 0.3
    assert all(piece.along_m < scene.room.left_y_m for scene in scenes for piece in scene.room.furniture)


def test_persons_stand_near_and_far_left_and_right_and_turned(scenes):
    still = [scene.people[0] for scene in scenes if scene.kind in ("point", "turn")]
    assert covers([math.dist(person.place_m, CAMERA) for person in still], 1.1, 3.5)
    bearings = [heading_to(CAMERA, person.place_m) for person in still]
    assert {bearing // 10 for bearing in bearings} > {-2, -1, 0, 1}
    fronts = [wrap_deg(person.heading_deg - heading_to(person.place_m, CAMERA)) for person in still]
    assert covers(fronts, -65, 65)


def test_pois_stand_apart_around_the_person(scenes):
    pointed = [scene for scene in scenes if scene.kind in ("point", "several", "walk")]
    assert {len(scene.pois) for scene in scenes} == set(range(3, 13))
    gaps = []
    for scene in pointed:
        stand = stand_of(scene.people[0])
        azimuths = [azimuth_of(stand, CAMERA, poi.position_m[:2]) for poi in scene.pois]
        gaps += [after - before for before, after in pairwise(azimuths)]
        assert all(0.99 <= math.dist(stand, poi.position_m[:2]) <= 4.01 for poi in scene.pois)
    assert min(gaps) > 9.8
    assert sum(gap < 13 for gap in gaps) > 0.2 * len(gaps)
    assert covers([poi.position_m[2] for scene in scenes for poi in scene.pois], 0.3, 2.0)


def test_pointings_vary(scenes):
    pointings = actions(scenes, Pointing)
    assert {pointing.style for pointing in pointings} == {"straight", "bent", "hip"}
    assert {pointing.hand for pointing in pointings} == {"index", "flat"}
    assert {pointing.arm for pointing in pointings} == {"left", "right"}
    assert covers([pointing.head_gain for pointing in pointings], 0.3, 1.05)
    assert covers([pointing.head_lag_s for pointing in pointings], -0.2, 0.3)
    assert covers([pointing.hold_s for pointing in pointings], 0.8, 2.1)
    assert 0.09 < share(pointings, lambda pointing: pointing.looks != "poi") < 0.21


def test_pointings_follow_each_other_and_walks(scenes):
    rows = [[action.type for action in person.actions] for scene in scenes for person in scene.people]
    assert 0.1 < sum(row.count("point") == 2 for row in rows) / sum("point" in row for row in rows) < 0.4
    assert any(row[:2] == ["walk", "point"] for row in rows)
    assert any(row[:2] == ["quiet", "point"] for row in rows)
    assert any(sum(bool(set(map(type, person.actions)) & {Pointing}) for person in scene.people) == 2 for scene in scenes)


def test_the_arm_is_mostly_that_of_the_side(scenes):
    same, other = 0, 0
    for scene in scenes:
        for person in scene.people[:1]:
            stand = stand_of(person)
            for pointing in (action for action in person.actions if isinstance(action, Pointing) and scene.kind != "walk"):
                target = next(poi for poi in scene.pois if poi.poi_id == pointing.poi)
                off_front = wrap_deg(heading_to(stand, target.position_m[:2]) - person.heading_deg)
                assert abs(off_front) < 119
                matches = (pointing.arm == "left") == (off_front > 0)
                same, other = same + matches, other + (not matches)
    assert 0.02 < other / (same + other) < 0.2


def test_quiet_scenes_have_every_gesture_and_no_pointing(scenes):
    quiet = [scene for scene in scenes if scene.kind in ("quiet", "turn")]
    assert not actions(quiet, Pointing)
    assert {gesture.gesture for gesture in actions(scenes, Quiet)} == set(QUIET_GESTURES)
    turns = [abs(turn.azimuth_deg) for turn in actions(scenes, HeadTurn)]
    assert max(turns) > 120
    assert any(not scene.people and (scene.light.flicker_depth or scene.light.changes) for scene in quiet)
    assert any(len(person.actions) == 3 for scene in quiet for person in scene.people)
    assert any(isinstance(person.actions[0], Walk) for scene in quiet for person in scene.people if person.actions)


def test_some_cameras_pan_or_drive_and_all_clips_are_short(scenes):
    assert 0.1 < share(scenes, lambda scene: bool(scene.robot_path)) < 0.26
    moved = [point for scene in scenes for point in scene.robot_path]
    assert any(point.yaw_deg for point in moved)
    assert any(point.x_m for point in moved)
    assert covers([scene.duration_s for scene in scenes], 4, 7)
    ends = [(action.end_s, scene.duration_s) for scene in scenes for action in actions([scene], Pointing)]
    assert all(end_s < duration_s for end_s, duration_s in ends)


def test_people_do_not_overlap(scenes):
    for scene in scenes:
        places = [person.place_m for person in scene.people]
        assert all(math.dist(a, b) >= 0.8 for i, a in enumerate(places) for b in places[:i])


def test_heads_are_in_the_picture_all_the_time_and_pointing_hands_nearly_always(scenes):
    hands = []
    for scene in (scene for scene in scenes if scene.kind in ("point", "turn")):
        person = scene.people[0]
        heads = [
            sight
            for time_s in (0.0, scene.duration_s / 2, scene.duration_s)
            for sight in framing.head_sights(person.place_m, person.height_m, time_s)
        ]
        assert framing.fits(heads, scene.camera, scene.robot_path)
        for action in actions([scene], Pointing):
            target = next(poi.position_m for poi in scene.pois if poi.poi_id == action.poi)
            sights = framing.pointing_sights(person.place_m, person.heading_deg, person.height_m, action, target)
            hands.append(framing.fits(sights, scene.camera, scene.robot_path))
    assert 0.9 < sum(hands) / len(hands) < 1.0


def test_exhibits_stand_in_nobodys_way(scenes):
    for scene in scenes:
        for poi in (poi for poi in scene.pois if poi.exhibit and scene.people):
            assert off_line_m(poi.position_m[:2], CAMERA, stand_of(scene.people[0])) > 0.5
            assert scene.room.right_y_m < poi.position_m[1] < scene.room.left_y_m
            assert scene.room.back_x_m < poi.position_m[0] < scene.room.front_x_m


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 5000), index=st.integers(0, 999))
def test_a_drawn_scene_is_the_same_again_and_survives_yaml(seed, index, tmp_path_factory):
    scene = draw_scene(seed, index)
    assert draw_scene(seed, index) == scene
    path = tmp_path_factory.mktemp("scene") / "scene.yaml"
    path.write_text(dump_scene(scene))
    assert load_scene(path) == scene
    assert Scene.model_validate_json(scene.model_dump_json()) == scene
    assert {person.avatar for person in scene.people} <= set(FITTING_AVATARS if seed < 1000 else HELD_OUT_AVATARS)


def test_a_scene_does_not_depend_on_the_count():
    assert drawn_scenes(5, 3) == drawn_scenes(5, 8)[:3]
    assert draw_scene(5, 2) == drawn_scenes(5, 3)[2]


def test_seeds_and_indices_differ():
    seen = {draw_scene(seed, index).model_dump_json() for seed in range(5) for index in range(5)}
    assert len(seen) == 25


def test_avatars_are_held_out():
    assert len(FITTING_AVATARS) == 8
    assert len(HELD_OUT_AVATARS) == 6
    assert not set(FITTING_AVATARS) & set(HELD_OUT_AVATARS)


def test_another_size_is_the_same_scene():
    for index in range(20):
        drawn, fixed = draw_scene(7, index), draw_scene(7, index, overrides=Overrides(size=(640, 480)))
        assert (fixed.camera.width, fixed.camera.height) == (640, 480)
        size = {"width": drawn.camera.width, "height": drawn.camera.height}
        assert fixed.model_copy(update={"camera": fixed.camera.model_copy(update=size)}) == drawn


def test_field_of_view_and_kinds_are_kept_to():
    drawn = [draw_scene(8, index, ("walk", "turn"), Overrides(fov_deg=(60, 62))) for index in range(30)]
    assert {scene.kind for scene in drawn} == {"walk", "turn"}
    assert all(60 <= scene.camera.horizontal_fov_deg <= 62 for scene in drawn)


def test_a_field_of_view_that_nobody_fits_is_refused():
    with pytest.raises(DrawingError, match="field of view"):
        draw_scene(1, 0, ("several",), Overrides(fov_deg=(3, 3)))


def test_bearings_agree_with_the_picture():
    """A positive azimuth is to the person's own left, which is the picture's right."""
    person = (2.0, 0.0)
    scene = draw_scene(1, 0)
    view = view_at(scene.camera.model_copy(update={"roll_deg": 0.0, "pitch_up_deg": 0.0}), robot_at([], 0.0))
    target = place_at(person, heading_to(person, CAMERA) + 40, 0.5)
    assert azimuth_of(person, CAMERA, target) == pytest.approx(40)
    assert view.project(to_world((*target, 1.0)))[0] > view.project(to_world((*person, 1.0)))[0]
