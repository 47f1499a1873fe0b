"""Plain scenes: like those of the first labelled clips, and without any of the difficulties that the others may have."""

import math
from collections import Counter
from itertools import pairwise

import cv2
import numpy as np
import pytest
from deixis_cli.options import CommandError
from deixis_evaluation.clips import load_clips
from deixis_simulation.actor import Actor
from deixis_simulation.avatars import FITTING_AVATARS, HELD_OUT_AVATARS
from deixis_simulation.bearings import azimuth_of, heading_to
from deixis_simulation.clip_files import ClipFiles
from deixis_simulation.command import drawn_scenes
from deixis_simulation.draw import draw_scene
from deixis_simulation.draw_room import SKIN_LIKE
from deixis_simulation.geometry import robot_at, view_at, wrap_deg
from deixis_simulation.scene import KINDS, HeadTurn, Pointing, Quiet, Walk, dump_scene, load_scene
from deixis_simulation.truth_meta import seed_and_index
from hypothesis import given, settings
from hypothesis import strategies as st
from simulation_ready import needs_renderer

CAMERA = (0.0, 0.0)


@pytest.fixture(scope="module")
def scenes():
    return [draw_scene(3000 + number // 100, number % 100, plain=True) for number in range(400)]


def actions(scenes, kind):
    return [action for scene in scenes for person in scene.people for action in person.actions if isinstance(action, kind)]


def pointings(scenes):
    """Scene, person and pointing."""
    for scene in scenes:
        for person in scene.people:
            yield from ((scene, person, action) for action in person.actions if isinstance(action, Pointing))


def target_of(scene, pointing):
    return next(poi.position_m for poi in scene.pois if poi.poi_id == pointing.poi)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 5000), index=st.integers(0, 999))
def test_a_plain_scene_is_the_same_again_and_survives_yaml(seed, index, tmp_path_factory):
    scene = draw_scene(seed, index, plain=True)
    assert draw_scene(seed, index, plain=True) == scene
    path = tmp_path_factory.mktemp("scene") / "scene.yaml"
    path.write_text(dump_scene(scene))
    assert load_scene(path) == scene
    assert {person.avatar for person in scene.people} <= set(FITTING_AVATARS if seed < 1000 else HELD_OUT_AVATARS)


def test_names_tell_plain_scenes_from_the_others():
    plain = draw_scene(1000, 3, ("point",), plain=True)
    assert plain.name == "p1000_003_point"
    assert seed_and_index(plain) == (1000, 3)
    assert draw_scene(1000, 3, ("point",)).name == "s1000_003_point"


def test_everybody_who_is_held_out_comes(scenes):
    assert {person.avatar for scene in scenes for person in scene.people} == set(HELD_OUT_AVATARS)


def test_the_camera_stands_upright_in_steady_light(scenes):
    for scene in scenes:
        camera, light = scene.camera, scene.light
        assert (camera.width, camera.height) == (640, 480)
        assert 58 <= camera.horizontal_fov_deg <= 70
        assert 1.2 <= camera.position_m[2] <= 1.4
        assert abs(camera.roll_deg) <= 1
        assert -2 < camera.pitch_up_deg < 9
        assert scene.robot_path == []
        steady = not light.changes and not light.flicker_depth
        assert steady == bool(scene.people)


def test_rooms_are_simple_and_not_of_the_colours_of_skin(scenes):
    assert {scene.room.wall for scene in scenes} == {"plaster", "brick"}
    assert not any(tone in SKIN_LIKE for scene in scenes for tone in (scene.room.wall_tone, scene.room.floor_tone))
    assert all(piece.tone is None for scene in scenes for piece in scene.room.furniture)


def test_people_stand_before_it_and_face_it(scenes):
    still = [scene for scene in scenes if scene.kind in ("point", "turn", "quiet", "several")]
    people = [person for scene in still for person in scene.people]
    away = [math.dist(person.place_m, CAMERA) for person in people]
    assert 1.1 <= min(away) < 1.4
    assert 3.2 < max(away) <= 3.5
    assert all(abs(wrap_deg(person.heading_deg - heading_to(person.place_m, CAMERA))) < 5.2 for person in people)
    assert all(person.height_m >= 1.5 for person in people)
    assert Counter(len(scene.people) for scene in still).keys() == {0, 1, 2}
    assert 0.03 < sum(len(scene.people) == 2 for scene in scenes) / len(scenes) < 0.15


def test_pois_stand_all_around_at_one_of_four_gaps(scenes):
    seen = Counter()
    for scene in (scene for scene in scenes if scene.kind in ("point", "several")):
        stand = scene.people[0].place_m
        azimuths = [azimuth_of(stand, CAMERA, poi.position_m[:2]) for poi in scene.pois]
        gaps = [after - before for before, after in pairwise(azimuths)]
        gap = min((10, 15, 22, 30), key=lambda known: abs(known - gaps[0]))
        assert gaps == pytest.approx([gap] * len(gaps), abs=0.1)
        assert azimuths[0] < -105
        assert azimuths[-1] > 105
        seen[gap] += 1
    assert set(seen) == {10, 15, 22, 30}
    assert min(seen.values()) > 0.15 * seen.total()


def test_exhibits_stand_apart_beside_who_points_and_nowhere_else(scenes):
    for scene in scenes:
        stand = scene.people[0].place_m if scene.people else None
        seen = [azimuth_of(stand, CAMERA, poi.position_m[:2]) for poi in scene.pois if poi.exhibit]
        assert bool(seen) == (scene.kind in ("point", "several"))
        assert all(abs(azimuth) > 49.9 for azimuth in seen)
        assert all(after - before > 24.9 for before, after in pairwise(seen))


def test_strokes_go_from_130_degrees_to_130_degrees(scenes):
    azimuths = [
        azimuth_of(person.place_m, CAMERA, target_of(scene, pointing)[:2]) for scene, person, pointing in pointings(scenes)
    ]
    assert -130.2 <= min(azimuths) < -115
    assert 115 < max(azimuths) <= 130.2
    assert min(Counter(min(int(abs(azimuth) // 30), 3) for azimuth in azimuths).values()) > 0.1 * len(azimuths)


def test_kinds_and_what_is_done_in_them(scenes):
    assert {scene.kind for scene in scenes} == set(KINDS)
    made = actions(scenes, Pointing)
    assert {pointing.style for pointing in made} == {"straight", "bent"}
    assert {pointing.looks for pointing in made} == {"poi"}
    assert {pointing.hand for pointing in made} == {"index"}
    gains = [pointing.head_gain for pointing in made]
    assert 0.7 <= min(gains) < 0.8
    assert max(gains) == 1
    assert 0.7 < sum(gain == 1 for gain in gains) / len(gains) < 0.9
    across = [
        pointing
        for scene, person, pointing in pointings(scenes)
        if (azimuth_of(person.place_m, CAMERA, target_of(scene, pointing)[:2]) > 6) != (pointing.arm == "left")
    ]
    assert len(across) > 5
    rows = [[action.type for action in scene.people[0].actions] for scene in scenes if scene.people]
    assert ["point", "point"] in rows
    quiet = [scene for scene in scenes if scene.kind not in ("point", "several")]
    assert not actions(quiet, Pointing)
    assert {gesture.gesture for gesture in actions(quiet, Quiet)} == {
        "wave", "stop", "facepass", "drink", "chin", "scratch", "hair", "glasses",
    }  # fmt: skip
    assert any(not scene.people for scene in quiet)
    assert any(scene.people and not scene.people[0].actions for scene in quiet)
    assert actions(quiet, Walk)
    nods = [turn for turn in actions(quiet, HeadTurn) if abs(turn.azimuth_deg) <= 6]
    turns = [turn for turn in actions(quiet, HeadTurn) if abs(turn.azimuth_deg) > 6]
    assert {turn.pitch_deg > 0 for turn in nods} == {True, False}
    assert max(abs(turn.azimuth_deg) for turn in turns) > 85


def test_heads_and_raised_hands_are_in_the_picture():
    """By where the people really are, not by the rule of thumb that scenes are drawn by."""
    for seed in range(1000, 1060):
        scene = draw_scene(seed, 0, ("point", "several", "turn"), plain=True)
        view = view_at(scene.camera, robot_at([], 0.0))
        for number, person in enumerate(scene.people):
            actor = Actor(person, scene, number)
            seen = [view.project(actor.moment(time_s).head_centre) for time_s in (0.0, scene.duration_s)]
            for action in actions([scene.model_copy(update={"people": [person]})], Pointing):
                begin_s = action.start_s + action.preparation_s
                moments = [actor.moment(begin_s + share * action.hold_s) for share in (0.0, 0.5, 1.0)]
                seen += [view.project(moment.fingertip[action.arm]) for moment in moments]
                assert all(view.in_camera(moment.fingertip[action.arm])[2] > 0.6 for moment in moments)
            assert all(15 < x < 625 and 15 < y < 465 for x, y in seen), scene.name


def test_a_hand_is_not_before_or_behind_somebody_else():
    for index in range(40):
        scene = draw_scene(1, index, ("several",), plain=True)
        first, second = scene.people
        view = view_at(scene.camera, robot_at([], 0.0))
        actor, other = Actor(first, scene, 0), Actor(second, scene, 1)
        for action in actions([scene], Pointing):
            time_s = action.start_s + action.preparation_s + action.hold_s / 2
            tip, middle = actor.moment(time_s).fingertip[action.arm], other.moment(time_s).head_centre
            apart_px = abs(view.project(tip)[0] - view.project(middle)[0])
            assert apart_px * view.in_camera(middle)[2] / view.matrix[0, 0] > 0.15, scene.name


def test_wide_pictures_are_refused_and_other_sizes_are_the_same_scene():
    with pytest.raises(CommandError, match="4:3"):
        drawn_scenes(5, 1, size=(1280, 720), plain=True)
    small, usual = drawn_scenes(5, 1, size=(320, 240), plain=True)[0], drawn_scenes(5, 1, plain=True)[0]
    assert small.camera.width == 320
    assert small.people == usual.people


@needs_renderer
def test_a_plain_clip_is_rendered_and_its_truth_holds(tmp_path):
    from deixis_simulation.jobs import render_all

    drawn = draw_scene(1003, 0, ("point",), plain=True)
    pointing = actions([drawn], Pointing)[0]
    soon = pointing.model_copy(update={"start_s": 0.0, "preparation_s": 0.1, "hold_s": 0.1, "retraction_s": 0.1})
    person = drawn.people[0].model_copy(update={"actions": [soon]})
    small = drawn.camera.model_copy(update={"width": 320, "height": 240})
    scene = drawn.model_copy(update={"people": [person], "duration_s": 0.3, "camera": small})
    assert render_all([scene], tmp_path, jobs=1, labels=True).failed == {}
    (clip,) = load_clips(tmp_path)
    truth = clip.truth
    assert (clip.name, truth.meta.kind) == ("p1003_000_point", "point")
    strokes = [frame.persons[0] for frame in truth.frames if frame.persons[0].phase == "stroke"]
    assert strokes
    target = target_of(scene, soon)
    at_body = azimuth_of(person.place_m, CAMERA, target[:2])
    labels = np.load(ClipFiles(tmp_path, scene.name).pictures)
    for frame in truth.frames:
        shown = frame.persons[0]
        if shown.phase != "stroke":
            continue
        assert shown.poi == soon.poi
        assert shown.poi_azimuth_deg == pytest.approx(at_body, abs=12)
        assert shown.user_pos.distance_m == pytest.approx(math.dist(person.place_m, CAMERA), abs=0.15)
        hand = getattr(shown.hands, soon.arm)
        part = cv2.imdecode(labels[f"f{frame.frame:04d}"], cv2.IMREAD_UNCHANGED) & 7
        x, y = hand.centroid_visible_px
        assert part[round(y), round(x)] == (3 if soon.arm == "right" else 4)
