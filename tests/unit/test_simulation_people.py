"""People of the simulator: bodies, pointing, quiet gestures, walks; and that a moment depends on its time alone."""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
import pytest
from deixis_simulation.actor import Actor, Moment
from deixis_simulation.avatars import AVATARS, FITTING_AVATARS, HELD_OUT_AVATARS, AvatarError, load_avatar
from deixis_simulation.body import Body, fit_body, head_size
from deixis_simulation.geometry import Floats, to_world, wrap_deg
from deixis_simulation.rotations import azimuth_deg
from deixis_simulation.scene import QUIET_GESTURES, ArmSide, Camera, Person, QuietGesture, Scene, ScenePoi
from hypothesis import given, settings
from hypothesis import strategies as st

CAMERA = np.array([0.0, 1.3, 0.0])
CHEAP = settings(max_examples=25, deadline=None)


def acting(actions: list[dict[str, Any]], poi: tuple[float, float, float] = (2.0, 2.0, 1.2), **person: Any) -> Actor:
    usual = {"avatar": "White_M_3_Casual", "place_m": (2.5, 0.0), "restlessness": 0.0}
    body = Person.model_validate({**usual, "actions": actions, **person})
    scene = Scene(
        duration_s=20, pois=[ScenePoi(poi_id="a", position_m=poi), ScenePoi(poi_id="b", position_m=(2, -2, 1))], people=[body]
    )
    return Actor(body, scene, 0)


def pointing(**fields: Any) -> dict[str, Any]:
    return {"type": "point", "start_s": 1.0, "poi": "a", "arm": "left", **fields}


def around(azimuth: float, distance: float = 2.5, height: float = 1.2) -> tuple[float, float, float]:
    """A place at that azimuth of a person at (2.5, 0) who faces the robot."""
    angle = math.radians(azimuth)
    return 2.5 - distance * math.cos(angle), -distance * math.sin(angle), height


def angle_deg(a: Floats, b: Floats) -> float:
    cosine = float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
    return math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))


def same(a: Moment, b: Moment) -> bool:
    return bool(
        np.array_equal(a.skeleton.positions, b.skeleton.positions)
        and np.array_equal(a.skeleton.rotations, b.skeleton.rotations)
    )


# --- avatars and bodies -----------------------------------------------------------------------------------------------


def test_held_out_avatars_are_no_fitting_ones() -> None:
    assert len(FITTING_AVATARS) == len(set(FITTING_AVATARS)) == 8
    assert len(HELD_OUT_AVATARS) == len(set(HELD_OUT_AVATARS)) == 6
    assert not set(FITTING_AVATARS) & set(HELD_OUT_AVATARS)


@pytest.mark.parametrize("names", [FITTING_AVATARS, HELD_OUT_AVATARS])
def test_both_sets_hold_dark_and_light_skin_and_both_sexes(names: tuple[str, ...]) -> None:
    words = [name.split("_") for name in names]
    assert {word[1] for word in words} == {"F", "M"}
    assert {"Black", "White"} <= {word[0] for word in words}


@pytest.mark.parametrize("name", AVATARS)
def test_an_avatar_is_complete(name: str) -> None:
    avatar = load_avatar(name)
    assert avatar.triangles.max() < len(avatar.vertices) == len(avatar.part) == len(avatar.is_hair)
    assert np.allclose(avatar.weights.sum(axis=1), 1, atol=1e-4)
    assert len(avatar.face_vertices) > 300
    assert not avatar.is_hair[avatar.face_vertices].any()
    assert avatar.is_hair.any()
    assert all(weights.sum() == pytest.approx(1) for weights in avatar.hand_weights.values())
    assert avatar.skin_mask.ndim == 2
    assert avatar.colours.shape[2] == avatar.normal_map.shape[2] == 3


def test_an_unknown_avatar_is_refused() -> None:
    with pytest.raises(AvatarError, match="no avatar 'Nobody'"):
        load_avatar("Nobody")


@CHEAP
@given(height=st.floats(1.1, 2.1), name=st.sampled_from(AVATARS))
def test_a_body_has_its_height_and_stands_on_the_floor(height: float, name: str) -> None:
    body = fit_body(load_avatar(name), height)
    assert body.vertices[:, 1].max() == pytest.approx(height, abs=1e-4)
    assert abs(body.vertices[:, 1].min()) < 0.01


def breadth_m(body: Body) -> float:
    """Of the head, ear to ear."""
    return float(np.ptp(body.vertices[body.avatar.face_vertices][:, 0]))


def test_heads_of_children_are_nearly_as_large_as_those_of_adults() -> None:
    assert head_size(1.17, 1.7) == pytest.approx(51.5 / 56, abs=0.01)  # around, at six years and of adults
    assert head_size(1.40, 1.7) == pytest.approx(53.5 / 56, abs=0.01)
    child, adult, tall = (fit_body(load_avatar("White_F_1_Casual"), height) for height in (1.2, 1.7, 1.95))
    assert 0.91 < breadth_m(child) / breadth_m(adult) < 0.94
    assert 1.01 < breadth_m(tall) / breadth_m(adult) < 1.05


# --- moments ----------------------------------------------------------------------------------------------------------

BUSY = [
    {"type": "walk", "start_s": 0.0, "to_m": (3.0, -1.0)},
    pointing(start_s=4.5),
    {"type": "quiet", "gesture": "beats", "start_s": 8.0},
    {"type": "turn", "start_s": 12.0, "azimuth_deg": -100.0},
]


@CHEAP
@given(times=st.permutations([0.3, 1.5, 4.7, 5.5, 7.2, 9.0, 12.5, 13.0]))
def test_a_moment_depends_on_its_time_alone(times: list[float]) -> None:
    one, other = acting(BUSY, restlessness=1.0), acting(BUSY, restlessness=1.0)
    expected = {time: one.moment(time) for time in sorted(times)}
    assert all(same(other.moment(time), expected[time]) for time in times)


@CHEAP
@given(time=st.floats(0, 15), height=st.floats(1.2, 2.0))
def test_bones_keep_their_lengths(time: float, height: float) -> None:
    actor = acting(BUSY, height_m=height, restlessness=2.0)
    skeleton, body = actor.moment(time).skeleton, actor.body
    rows = np.array([row for row in body.order if actor.avatar.parent[row] >= 0])
    parents = actor.avatar.parent[rows]
    assert np.allclose(
        np.linalg.norm(skeleton.positions[rows] - skeleton.positions[parents], axis=1),
        np.linalg.norm(body.joints[rows] - body.joints[parents], axis=1),
        atol=1e-9,
    )
    assert np.allclose(skeleton.rotations @ skeleton.rotations.transpose(0, 2, 1), np.eye(3), atol=1e-9)


def test_movements_are_continuous() -> None:
    actor = acting(BUSY, restlessness=1.0)
    hands = np.array([[*actor.moment(time).wrist.values()] for time in np.arange(0, 15, 1 / 60)])
    speed = np.linalg.norm(np.diff(hands, axis=0), axis=2) * 60
    assert speed.max() < 6.0


def test_the_mesh_is_of_the_moment() -> None:
    actor = acting([])
    moment = actor.moment(1.0)
    mesh = actor.mesh(moment)
    assert mesh.vertices.dtype == mesh.normals.dtype == np.float32
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-3)
    assert mesh.vertices[:, 1].max() == pytest.approx(1.75, abs=0.01)
    assert abs(mesh.vertices[:, 1].min()) < 0.01
    hand = mesh.vertices[actor.avatar.hand_vertices["left"]]
    assert np.linalg.norm(hand - moment.fingertip["left"], axis=1).min() < 0.01


# --- pointing ---------------------------------------------------------------------------------------------------------


def test_phases_stand_at_their_times() -> None:
    actor = acting([pointing(start_s=1.0, preparation_s=0.5, hold_s=1.0, retraction_s=0.5)])
    expected = {0.9: "none", 1.2: "preparation", 1.6: "stroke", 2.4: "stroke", 2.8: "retraction", 3.1: "none"}
    moments = {time: actor.moment(time) for time in expected}
    assert {time: moment.phase for time, moment in moments.items()} == expected
    assert {moment.nonpoint_phase for moment in moments.values()} == {"none"}
    assert [moment.poi for moment in moments.values()] == [None, "a", "a", "a", "a", None]
    assert [moment.gesture == "point" for moment in moments.values()] == [False, True, True, True, True, False]
    assert moments[1.6].arm_side == "left"


@CHEAP
@given(
    azimuth=st.floats(-180, 180),
    height=st.floats(0.6, 2.0),
    distance=st.floats(1.5, 5.0),
    arm=st.sampled_from(get_args(ArmSide)),
    gain=st.floats(0, 2),
    heading=st.floats(0, 360),
)
def test_a_straight_arm_points_at_the_poi(
    azimuth: float, height: float, distance: float, arm: ArmSide, gain: float, heading: float
) -> None:
    poi = around(azimuth, distance, height)
    moment = acting([pointing(arm=arm, torso_gain=gain)], poi, heading_deg=heading).moment(2.2)
    target, tip = to_world(poi), moment.fingertip[arm]
    between = (moment.eyes + moment.shoulder[arm]) / 2
    assert angle_deg(tip - between, target - between) < 3
    assert angle_deg(tip - moment.eyes, target - moment.eyes) < 17
    finger = tip - moment.index_base[arm]
    assert angle_deg(finger, target - moment.index_base[arm]) < 10


@pytest.mark.parametrize("style", ["bent", "hip"])
@pytest.mark.parametrize("azimuth", [-130, -60, 0, 60, 130])
@pytest.mark.parametrize("arm", ["left", "right"])
def test_a_bent_arm_points_with_its_forearm(style: str, azimuth: float, arm: ArmSide) -> None:
    poi = around(azimuth)
    moment = acting([pointing(arm=arm, style=style)], poi).moment(2.2)
    forearm = moment.wrist[arm] - moment.elbow[arm]
    assert angle_deg(forearm, to_world(poi) - moment.elbow[arm]) < 4
    assert moment.elbow[arm][1] < moment.shoulder[arm][1]
    upper = moment.elbow[arm] - moment.shoulder[arm]
    assert 20 < angle_deg(upper, forearm) < 130


def test_the_head_does_its_share_and_overshoots() -> None:
    poi = around(60)

    def yaw(**fields: Any) -> float:
        moment = acting([pointing(**fields)], poi).moment(2.2)
        return azimuth_deg(moment.head_rotation[:, 2])

    moment = acting([pointing()], poi).moment(2.2)
    azimuth = azimuth_deg(to_world(poi) - moment.head_centre)
    assert yaw() == pytest.approx(azimuth, abs=0.5)
    assert yaw(head_gain=0.5) == pytest.approx(azimuth / 2, abs=1)
    assert yaw(head_overshoot_deg=5) == pytest.approx(azimuth + 5, abs=0.5)
    assert yaw(looks="robot") == pytest.approx(0, abs=1)
    assert yaw(looks="elsewhere", elsewhere_deg=-40) == pytest.approx(-40, abs=1)


@pytest.mark.parametrize("looks", ["poi", "robot", "elsewhere"])
@pytest.mark.parametrize("heading", [0, 90, 180, 270])
@pytest.mark.parametrize("arm", ["left", "right"])
def test_the_neck_never_turns_too_far(looks: str, heading: float, arm: ArmSide) -> None:
    actor = acting([pointing(looks=looks, arm=arm, elsewhere_deg=100)], around(-120), heading_deg=heading)
    for time in np.arange(-0.1, 4, 0.1):
        skeleton = actor.moment(float(time)).skeleton
        assert angle_deg(skeleton.rotation("Head")[:, 2], skeleton.rotation("Spine2")[:, 2]) < 90


def test_the_head_comes_before_or_after_the_arm() -> None:
    early, late = (acting([pointing(head_lag_s=lag)]).moment(1.2) for lag in (-0.2, 0.3))
    turned = [abs(azimuth_deg(moment.head_rotation[:, 2])) for moment in (early, late)]
    assert turned[0] > turned[1] + 5


def test_two_pointings_in_a_row() -> None:
    actor = acting([pointing(start_s=1.0), pointing(start_s=4.0, poi="b", arm="right", hand="flat")])
    first, pause, second = (actor.moment(time) for time in (2.2, 3.8, 5.2))
    assert [moment.poi for moment in (first, pause, second)] == ["a", None, "b"]
    assert [moment.arm_side for moment in (first, pause, second)] == ["left", None, "right"]
    target = to_world((2, -2, 1))
    assert angle_deg(second.fingertip["right"] - second.eyes, target - second.eyes) < 17


# --- quiet gestures and looks -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("gesture", QUIET_GESTURES)
@pytest.mark.parametrize("arm", ["left", "right"])
def test_a_quiet_gesture_moves_a_hand_and_is_no_pointing(gesture: QuietGesture, arm: ArmSide) -> None:
    actor = acting([{"type": "quiet", "gesture": gesture, "arm": arm, "start_s": 1.0}])
    before, meanwhile, after = (actor.moment(time) for time in (0.9, 2.3, 4.5))
    assert np.linalg.norm(meanwhile.wrist[arm] - before.wrist[arm]) > 0.15
    assert np.linalg.norm(after.wrist[arm] - before.wrist[arm]) < 0.02
    assert (meanwhile.gesture, meanwhile.phase, meanwhile.nonpoint_phase, meanwhile.poi) == (gesture, "none", "stroke", None)
    assert (before.gesture, before.nonpoint_phase, after.gesture) == ("none", "none", "none")


@pytest.mark.parametrize("gesture", QUIET_GESTURES)
@pytest.mark.parametrize("arm", ["left", "right"])
def test_the_wrist_stays_out_of_the_head(gesture: QuietGesture, arm: ArmSide) -> None:
    actor = acting([{"type": "quiet", "gesture": gesture, "arm": arm, "start_s": 0.0, "hold_s": 3.0}])
    for time in np.arange(0, 4, 0.1):
        moment = actor.moment(float(time))
        assert all(np.linalg.norm(wrist - moment.head_centre) > 0.14 for wrist in moment.wrist.values())


@pytest.mark.parametrize("azimuth", [-130, -80, -30, 30, 80, 130])
def test_a_head_turn_reaches_its_azimuth_and_the_trunk_helps(azimuth: float) -> None:
    actor = acting([{"type": "turn", "start_s": 1.0, "azimuth_deg": azimuth}])
    moment = actor.moment(2.0)
    assert azimuth_deg(moment.head_rotation[:, 2]) == pytest.approx(azimuth, abs=1)
    chest = azimuth_deg(moment.skeleton.rotation("Spine2")[:, 2])
    assert abs(wrap_deg(azimuth - chest)) <= 76
    assert (moment.gesture, moment.phase) == ("headturn", "none")
    assert abs(azimuth_deg(actor.moment(4.0).head_rotation[:, 2])) < 1


# --- walks ------------------------------------------------------------------------------------------------------------


def test_a_walk_ends_at_its_place_toward_the_robot() -> None:
    actor = acting([{"type": "walk", "start_s": 0.5, "to_m": (3.0, -2.0)}])
    (end,) = actor.walk_ends_s
    middle, after = actor.moment(1.8), actor.moment(end + 0.1)
    assert (middle.gesture, after.gesture) == ("walk", "none")
    assert np.allclose(after.place, to_world((3.0, -2.0)))
    assert abs(wrap_deg(after.azimuth_deg - azimuth_deg(CAMERA - after.place))) < 1
    assert np.linalg.norm(middle.place - to_world((2.5, 0.0))) > 0.2


def test_feet_do_not_slide_or_sink_while_walking() -> None:
    actor = acting([{"type": "walk", "start_s": 0.0, "to_m": (3.0, -4.0), "speed_m_s": 1.2}])
    lowest = [actor.mesh(actor.moment(time)).vertices[:, 1].min() for time in np.arange(0.0, actor.walk_ends_s[0], 0.05)]
    assert min(lowest) > -0.03
    assert max(lowest) < 0.03
    ankles = np.array(
        [
            [actor.moment(time).skeleton.position(f"{side}Foot") for side in ("Right", "Left")]
            for time in np.arange(1.5, 3.0, 0.02)
        ]
    )
    speed = np.linalg.norm(np.diff(ankles[:, :, [0, 2]], axis=0), axis=2) / 0.02
    assert np.median(speed.min(axis=1)) < 0.45


def test_pointing_after_a_walk_is_from_there() -> None:
    poi = (1.0, -3.0, 1.4)
    actor = acting([{"type": "walk", "start_s": 0.0, "to_m": (3.0, -1.0)}, pointing(start_s=5.0)], poi)
    moment = actor.moment(6.2)
    target = to_world(poi)
    assert angle_deg(moment.fingertip["left"] - moment.eyes, target - moment.eyes) < 17


def test_a_glance_at_the_robot_while_walking() -> None:
    plain, glancing = (
        acting([{"type": "walk", "start_s": 0.0, "to_m": (2.5, -4.0), "glance_s": glance}]).moment(2.4)
        for glance in (None, (1.5, 3.0))
    )
    toward = azimuth_deg(CAMERA - glancing.head_centre)
    assert abs(wrap_deg(azimuth_deg(glancing.head_rotation[:, 2]) - toward)) < 10
    assert abs(wrap_deg(azimuth_deg(plain.head_rotation[:, 2]) - toward)) > 30


def test_who_points_without_looking_looks_down_at_a_low_robot() -> None:
    body = Person.model_validate(
        {"avatar": "White_M_3_Casual", "place_m": (1.2, 0.0), "height_m": 1.9, "actions": [pointing(looks="robot")]}
    )
    camera = Camera(position_m=(0.0, 0.0, 0.8))
    scene = Scene(duration_s=5, camera=camera, pois=[ScenePoi(poi_id="a", position_m=(2.0, 2.0, 1.2))], people=[body])
    moment = Actor(body, scene, 0).moment(2.2)
    assert moment.head_rotation[1, 2] < -0.25


@pytest.mark.parametrize("azimuth", [-20, 30, 75, 115])
def test_a_straight_arm_is_nearly_stretched(azimuth: float) -> None:
    moment = acting([pointing()], around(azimuth)).moment(2.2)
    upper, fore = moment.elbow["left"] - moment.shoulder["left"], moment.wrist["left"] - moment.elbow["left"]
    assert angle_deg(upper, fore) < 40
