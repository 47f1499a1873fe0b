"""Heads under conditions that a robot meets, each beside the same heads without it: what a condition may cost in yaw.

Of rendered people whom nothing was fitted on, through the whole core of the stage with its default method. The bounds leave
room for any fit of the network that is worth having, and nothing is chosen by them. In tests/replay/test_headpose_clips.py are
six people, faces of 20 to 300 px, 10 and 60 frames a second and turns of 14 degrees a frame; in test_headpose_regressed_head.py
is an hour's rest.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np
import pytest
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_headpose.head import Pose
from deixis_runtime.lens import Lens
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import HeadPose
from deixis_simulation.arms import hanging_arm
from deixis_simulation.avatars import HELD_OUT_AVATARS, Picture, load_avatar
from deixis_simulation.body import Body, fit_body
from deixis_simulation.dice import Dice
from deixis_simulation.geometry import Floats, View
from deixis_simulation.mixed_heads import _without_wig, reduced
from deixis_simulation.portrait_arms import direction_of, raised_arm
from deixis_simulation.portrait_props import with_glasses
from deixis_simulation.renderer import Renderer, Tints, over
from deixis_simulation.rotations import unit
from deixis_simulation.skeleton import SIDES, Posture, Skeleton, solve
from deixis_simulation.skinning import skin
from deixis_simulation.studio import behind, draw_camera, draw_rooms, empty_room, light_person
from deixis_simulation.truth_head import MIRROR
from face_track import face_track
from simulation_ready import needs_renderer

pytestmark = needs_renderer

SIDE_PX, SIDE_M, AWAY_M = 128, 0.64, 2.5
"""A picture is a square of so many pixels and, at the head, so many metres; the head is so far away."""
FOCAL_PX, MIDDLE_PX = SIDE_PX * AWAY_M / SIDE_M, (SIDE_PX - 1) / 2
LENS = Lens(SIDE_PX, SIDE_PX, (FOCAL_PX, FOCAL_PX, MIDDLE_PX, MIDDLE_PX))
AROUND_DEG = (-70.0, -40.0, -15.0, 10.0, 35.0, 60.0)
"""Where cameras stand, from the way that a head faces."""
ADULT_M, CHILD_M = 1.72, 1.2
PEOPLE = ("Asian_F_1_Casual", "Black_M_2_Casual", "MENA_M_2_Casual", "White_F_1_Casual")
"""Of those who were held out; the last has long hair, on a scalp of skin."""
BEFORE_DEG = np.array([[-18, 0], [-6, -6], [0, 0], [5, 8], [12, -3], [25, 0]])
"""Bearings of cameras from that of a raised hand: it is before the face, or beside it."""
USUAL_DEG, READ = 10.0, 0.9
"""Without a condition heads are read better than this, in the mean; and of all, at least this share is told."""
FRAMES, FRAME_NS = 3, 33_333_333


@dataclass(frozen=True)
class Shown:
    """A head as a camera sees it. picture: (SIDE_PX, SIDE_PX, 3) BGR."""

    picture: Picture
    skeleton: Skeleton
    view: View

    @property
    def yaw_deg(self) -> float:
        """True, to the line head -> camera; the head is on the camera's axis."""
        rotation = self.view.rotation @ self.skeleton.rotation("Head")
        return Pose(rotation @ MIRROR, np.array([0.0, 0.0, 1.0])).angles_deg()[0]


def standing(body: Body) -> Posture:
    """With both arms hanging."""
    return Posture(arms={side: hanging_arm(body, side) for side in SIDES})


def shown(seed: int, body: Body, posture: Posture, bearings_deg: Floats) -> Iterator[Shown]:
    """A body in its posture, by a camera at each of these bearings (azimuth, elevation); light and noise by the seed."""
    scene, room = studio()
    rng = np.random.default_rng(seed)
    skeleton = solve(body, posture)
    mesh = skin(skeleton, posture.morphs)
    renderer = Renderer(SIDE_PX, SIDE_PX)
    try:
        renderer.add_person(body.avatar, Tints())
        light_person(renderer, scene.light, Dice(rng), skeleton, mesh)
        sensor = draw_camera(scene, Dice(rng), SIDE_PX)
        for number, bearing in enumerate(bearings_deg):
            view = camera_at(skeleton, bearing)
            light = over(renderer.people(view), behind(rng, [room], SIDE_PX))
            if number == 0:
                sensor.meter(light)
            yield Shown(sensor.expose(light, number, 1.0), skeleton, view)
    finally:
        renderer.close()


@cache
def studio():
    """A scene for its light and camera, and its empty room."""
    (scene,) = draw_rooms(np.random.default_rng(8), 1)
    return scene, empty_room(scene)


def camera_at(skeleton: Skeleton, bearing_deg: Floats) -> View:
    """A camera that looks straight at the head."""
    back = direction_of(bearing_deg)
    eye = skeleton.carried("Head", skeleton.body.head_centre) + back * AWAY_M
    across = unit(np.cross([0.0, 1.0, 0.0], back))
    rotation = np.stack([across, -np.cross(back, across), -back])
    matrix = np.array([[FOCAL_PX, 0.0, MIDDLE_PX], [0.0, FOCAL_PX, MIDDLE_PX], [0.0, 0.0, 1.0]])
    return View(SIDE_PX, SIDE_PX, matrix, rotation, -rotation @ eye)


@cache
def body_of(name: str, height_m: float = ADULT_M) -> Body:
    """An avatar at a height."""
    return fit_body(reduced(load_avatar(name)), height_m)


def from_around(bodies: Sequence[Body]) -> list[Shown]:
    """Bodies with hanging arms, each from all around."""
    bearings_deg = np.array([[azimuth, 4.0] for azimuth in AROUND_DEG])
    return [head for seed, body in enumerate(bodies) for head in shown(seed, body, standing(body), bearings_deg)]


@cache
def adults() -> list[Shown]:
    """People as they are, from all around."""
    return from_around([body_of(name) for name in PEOPLE])


def answers(heads: Sequence[Shown], change: Callable[[Picture], Picture] = np.copy) -> list[HeadPose]:
    """What the stage says of each head after a few equal frames, its picture changed so."""
    said, face = [], face_track(MIDDLE_PX, MIDDLE_PX, FACE_WIDTH_M * SIDE_PX / SIDE_M)
    for head in heads:
        estimator, picture = HeadPoseEstimator(HeadposeConfig()), change(head.picture)
        for number in range(FRAMES):
            poses = estimator.update(picture, [face], LENS, 1, number * FRAME_NS)
        said += poses
    return said


def mean_error_deg(heads: Sequence[Shown], said: Sequence[HeadPose]) -> float:
    """Of the yaws; nearly all have to be told."""
    pairs = [(pose.yaw_deg, head.yaw_deg) for head, pose in zip(heads, said, strict=True) if pose.yaw_deg is not None]
    assert len(pairs) >= READ * len(heads)
    return float(np.mean([abs((told - true + 180) % 360 - 180) for told, true in pairs]))


def mean_sigma_deg(said: Sequence[HeadPose]) -> float:
    """Of the yaws that are told."""
    return float(np.mean([pose.yaw_sigma_deg for pose in said if pose.yaw_sigma_deg is not None]))


def cost_deg(heads: Sequence[Shown], said: Sequence[HeadPose], beside: Sequence[Shown]) -> float:
    """By how much worse they are read than the heads beside them, which have to be read well."""
    usual = mean_error_deg(beside, answers(beside))
    assert usual < USUAL_DEG
    return mean_error_deg(heads, said) - usual


def blurred(picture: Picture) -> Picture:
    """Out of focus, by a twentieth of a face's width."""
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.05 * FACE_WIDTH_M * SIDE_PX / SIDE_M), np.uint8)


def dragged(picture: Picture) -> Picture:
    """Moved across by a fifth of a face's width while the shutter was open."""
    length = round(0.2 * FACE_WIDTH_M * SIDE_PX / SIDE_M)
    return np.asarray(cv2.blur(picture, (length, 1)), np.uint8)


def noisy(picture: Picture) -> Picture:
    """With noise of 12 grey levels on top of the camera's own."""
    noise = np.random.default_rng(3).normal(0, 12, picture.shape)
    return np.clip(picture + noise, 0, 255).astype(np.uint8)


def test_people_who_were_held_out_are_read_from_all_around() -> None:
    assert set(PEOPLE) <= set(HELD_OUT_AVATARS)
    assert mean_error_deg(adults(), answers(adults())) < USUAL_DEG


@pytest.mark.parametrize("change", [blurred, dragged, noisy])
def test_blur_and_noise_cost_less_than_6_degrees(change: Callable[[Picture], Picture]) -> None:
    assert cost_deg(adults(), answers(adults(), change), adults()) < 6


def test_glasses_cost_less_than_5_degrees() -> None:
    rng = np.random.default_rng(6)
    worn = [replace(head, picture=with_glasses(rng, head.picture, head.skeleton, head.view)) for head in adults()]
    assert all(not np.array_equal(one.picture, other.picture) for one, other in zip(worn, adults(), strict=True))
    assert cost_deg(worn, answers(worn), adults()) < 5


def test_long_hair_costs_less_than_8_degrees() -> None:
    """Of one who has it, beside the same without: it hides ears and cheeks."""
    avatar = reduced(load_avatar(PEOPLE[-1]))
    bald = replace(avatar, vertices=_without_wig(avatar, avatar.vertices.astype(float)).astype(np.float32))
    assert not np.array_equal(bald.vertices, avatar.vertices)
    long, short = (from_around([fit_body(look, ADULT_M)]) for look in (avatar, bald))
    assert cost_deg(long, answers(long), short) < 8


def test_children_are_read_as_adults_are_within_5_degrees() -> None:
    children = from_around([body_of(name, CHILD_M) for name in PEOPLE])
    assert cost_deg(children, answers(children), adults()) < 5


def test_a_hand_over_the_face_costs_less_than_20_degrees_and_the_sigma_tells_of_it() -> None:
    """Beside the same heads, by the same cameras, with the arm let down."""
    raised: list[Shown] = []
    hanging: list[Shown] = []
    for seed, body in enumerate(map(body_of, PEOPLE)):
        up = standing(body)
        side, up.arms[side], bearing_deg = raised_arm(np.random.default_rng(seed), body)
        raised += shown(seed, body, up, bearing_deg + BEFORE_DEG)
        hanging += shown(seed, body, standing(body), bearing_deg + BEFORE_DEG)
    covered = answers(raised)
    assert cost_deg(raised, covered, hanging) < 20
    assert mean_sigma_deg(covered) > mean_sigma_deg(answers(hanging))
