"""People to fit the finder of heads and hands on: whole figures of any size, turn and gesture, before any room.

As with portraits, heads are mixed of several avatars' (`mixed_heads.py`), and what a camera adds on top (size, noise, grey) is
left to who uses the pictures. Every other picture has one more person behind the first, as drawn for an earlier picture.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .arms import Arm, arm_from_directions, hanging_arm, outward
from .avatars import WIGGED, Avatar, Picture, load_avatar
from .body import Body, fit_body
from .dice import Dice
from .draw_bodies import draw_bodies
from .geometry import Floats, View
from .gestures import gesture_arms
from .hand_shapes import FIST, FLAT, INDEX, OPEN, REST
from .label_image import HAND, HEAD, PART_BITS
from .mixed_heads import mixed_head, reduced
from .portrait_arms import direction_of, raised_arm
from .portraits import warped_head
from .renderer import FloatPicture, Renderer, Tints, over
from .rotations import about, unit
from .scene import ArmSide, Light, Quiet, QuietGesture
from .skeleton import SIDES, Posture, Skeleton, solve
from .skinning import Mesh, skin
from .smooth_noise import SmoothNoise
from .studio import behind, draw_camera, draw_rooms, empty_room, light_person

SIDE_PX = 192
ROOMS = 40
VIEWS = 10
"""Figures of one person in one posture and light."""
HEAD_PX = (10.0, 70.0)
"""Breadths of heads."""
NEAR_M, FAR_M = 0.8, 5.0
MIXED, LONG_HAIR, ACCOMPANIED = 0.7, 0.15, 0.5
AT_REST, BEFORE_HEAD, QUIET = 0.3, 0.1, 0.25
"""Shares of arms that hang, that are held before the head, and that do something but point; the others are stretched."""
SHAPES = (INDEX, INDEX, INDEX, FLAT, OPEN, FIST, REST)
GESTURES: tuple[QuietGesture, ...] = (
    "wave", "stop", "thumb", "scratch", "phone", "beats", "drink", "hips", "crossed", "chin", "hair", "glasses", "carry",
    "facepass",
)  # fmt: skip
KEPT = 24
"""Figures kept to stand behind others."""


@dataclass(frozen=True)
class Truth:
    """One person of a picture. centre_px (2,): middle of the skull, breadth_px: ear to ear, head_px: pixels of the head
    that are seen, seen: their share of all. hands_px (2, 2): right and left one, middle of what is seen; hand_areas_px (2,):
    how much that is.
    """

    centre_px: Floats
    breadth_px: float
    head_px: int
    seen: float
    hands_px: Floats
    hand_areas_px: Floats


@dataclass(frozen=True)
class Figure:
    """A square picture (SIDE_PX, SIDE_PX, 3) BGR and who is in it, the nearest first."""

    picture: Picture
    people: list[Truth]


@dataclass(frozen=True)
class _Layer:
    """One person alone: light (h, w, 4), labels (h, w), where the head is."""

    light: FloatPicture
    labels: Picture
    centre_px: Floats
    breadth_px: float


def figures(seed: int, avatars: Sequence[str], count: int, rooms: int = ROOMS) -> Iterator[Figure]:
    """So many pictures of people made from these avatars; the same for the same arguments.

    Raises RenderError; AvatarError for fewer than two avatars.
    """
    rng = np.random.default_rng(seed)
    scenes = draw_rooms(rng, rooms)
    pictures = [empty_room(scene) for scene in scenes]
    studios: dict[str, Renderer] = {}
    earlier: deque[_Layer] = deque(maxlen=KEPT)
    made = 0
    try:
        while made < count:
            dice = Dice(rng)
            scene = scenes[int(rng.integers(len(scenes)))]
            camera = draw_camera(scene, dice, SIDE_PX)
            for layer in _standing(rng, avatars, dice, scene.light, studios, min(VIEWS, count - made)):
                layers = [layer]
                if earlier and rng.random() < ACCOMPANIED:
                    layers.append(earlier[int(rng.integers(len(earlier)))])
                light = behind(rng, pictures, SIDE_PX)
                for one in reversed(layers):
                    light = over(one.light, light)
                camera.meter(light)
                picture = camera.expose(light, made, float(rng.uniform(0.6, 1.5)))
                yield Figure(picture, _truths(layers))
                earlier.append(layer)
                made += 1
    finally:
        for studio in studios.values():
            studio.close()


def _truths(layers: Sequence[_Layer]) -> list[Truth]:
    covered = np.zeros((SIDE_PX, SIDE_PX), bool)
    found = []
    for layer in layers:
        free = np.where(covered, 0, layer.labels)
        found.append(_truth(layer, free))
        covered |= layer.labels > 0
    return found


def _truth(layer: _Layer, free: Picture) -> Truth:
    parts, whole = free & PART_BITS & 15, layer.labels & PART_BITS & 15
    head = int((parts == HEAD).sum())
    hands, areas = np.zeros((2, 2)), np.zeros(2)
    for number, side in enumerate(SIDES):
        rows, columns = np.nonzero(parts == HAND[side])
        areas[number] = len(rows)
        if len(rows):
            hands[number] = columns.mean(), rows.mean()
    return Truth(layer.centre_px, layer.breadth_px, head, head / max(1, int((whole == HEAD).sum())), hands, areas)


# --- one person -----------------------------------------------------------------------------------------------------------


def _standing(
    rng: np.random.Generator,
    avatars: Sequence[str],
    dice: Dice,
    light: Light,
    studios: dict[str, Renderer],
    count: int,
) -> Iterator[_Layer]:
    drawn = draw_bodies(dice, avatars, 1)[0]
    base = WIGGED if WIGGED in avatars and rng.random() < LONG_HAIR else drawn.avatar
    avatar = mixed_head(base, avatars, rng) if rng.random() < MIXED else reduced(load_avatar(base))
    body = warped_head(fit_body(avatar, drawn.height_m), rng)
    skeleton = solve(body, posture := _posture(rng, body))
    mesh = skin(skeleton, posture.morphs)
    studio = _studio(avatar, studios)
    studio.repaint(0, avatar)
    studio.tint(0, Tints(drawn.skin_tint, drawn.hair_tint, drawn.clothes_tint))
    light_person(studio, light, dice, skeleton, mesh)
    breadth_m = _breadth_m(avatar, mesh)
    for number in range(count):
        view = _view(rng, skeleton, breadth_m)
        depth = float(view.in_camera(skeleton.carried("Head", body.head_centre))[2])
        yield _Layer(
            studio.people(view, smooth=number % 4 == 0),
            studio.labels(view),
            view.project(skeleton.carried("Head", body.head_centre)),
            breadth_m * view.matrix[0, 0] / depth,
        )


def _studio(avatar: Avatar, studios: dict[str, Renderer]) -> Renderer:
    if avatar.name not in studios:
        studios[avatar.name] = Renderer(SIDE_PX, SIDE_PX)
        studios[avatar.name].add_person(avatar, Tints())
    studios[avatar.name].take_over()
    return studios[avatar.name]


def _breadth_m(avatar: Avatar, mesh: Mesh) -> float:
    rows = avatar.head_vertices
    at = avatar.vertices[rows] - avatar.eyes
    ears = (at[:, 1] > -0.13) & (at[:, 1] < 0.0) & (at[:, 2] < -0.03)
    ends = rows[np.argmin(np.where(ears, at[:, 0], 9))], rows[np.argmax(np.where(ears, at[:, 0], -9))]
    return float(np.linalg.norm(mesh.vertices[ends[0]].astype(float) - mesh.vertices[ends[1]]))


def _posture(rng: np.random.Generator, body: Body) -> Posture:
    posture = Posture(
        arms={side: hanging_arm(body, side, *rng.uniform(-0.03, 0.03, 3)) for side in SIDES},
        spine=(float(rng.normal(0, 12)), float(rng.normal(2, 6)), float(rng.normal(0, 3))),
        head=(
            float(np.clip(rng.normal(0, 35), -75, 75)),
            float(np.clip(rng.normal(-4, 12), -35, 30)),
            float(np.clip(rng.normal(0, 7), -25, 25)),
        ),
    )
    for side in SIDES:
        posture.arms.update(_arms(rng, body, posture, side))
    return posture


def _arms(rng: np.random.Generator, body: Body, posture: Posture, side: ArmSide) -> dict[ArmSide, Arm]:
    kind = rng.random()
    if kind < AT_REST:
        return {}
    if kind < AT_REST + BEFORE_HEAD:
        which, arm, _ = raised_arm(rng, body)
        return {which: arm}
    if kind < AT_REST + BEFORE_HEAD + QUIET:
        action = Quiet(gesture=GESTURES[int(rng.integers(len(GESTURES)))], start_s=0.0, arm=side)
        since_s = float(rng.uniform(0, action.hold_s))
        noise = SmoothNoise(rng, 8, (0.1, 0.6))
        return gesture_arms(action, body, posture, since_s, since_s, noise)
    return {side: _stretched(rng, body, side)}


def _stretched(rng: np.random.Generator, body: Body, side: ArmSide) -> Arm:
    """An arm that points somewhere, straight or bent, from the shoulder or from the hip."""
    bearing = np.array([outward(side) * rng.uniform(-60, 130), np.clip(rng.normal(0, 28), -70, 65)])
    upper = direction_of(bearing)
    if rng.random() < 0.3:
        upper = unit(upper + np.array([0.0, -rng.uniform(0.3, 1.5), 0.0]))
    fore = unit(direction_of(bearing) + rng.normal(0, 0.25, 3))
    hand = unit(fore + rng.normal(0, 0.2, 3))
    shape = SHAPES[int(rng.integers(len(SHAPES)))]
    return arm_from_directions(body, side, np.eye(3), upper, fore, hand, shape, pronation_deg=float(rng.uniform(-60, 90)))


def _view(rng: np.random.Generator, skeleton: Skeleton, breadth_m: float) -> View:
    """A camera that has the head somewhere in its picture, mostly in the upper half; mostly the person faces it."""
    yaw = float(rng.normal(0, 45) if rng.random() < 0.75 else rng.uniform(-180, 180))
    back = direction_of(np.array([yaw, float(np.clip(rng.normal(0, 10), -30, 35))]))
    distance = float(np.exp(rng.uniform(np.log(NEAR_M), np.log(FAR_M))))
    centre = skeleton.carried("Head", skeleton.body.head_centre)
    across = unit(np.cross([0.0, 1.0, 0.0], back))
    rotation = about([0.0, 0.0, 1.0], float(np.clip(rng.normal(0, 5), -15, 15)))
    rotation = rotation @ np.stack([across, -np.cross(back, across), -back])
    focal = float(np.exp(rng.uniform(*np.log(HEAD_PX)))) / breadth_m * distance
    middle = SIDE_PX * np.array([rng.uniform(0.1, 0.9), rng.beta(1.6, 2.8)])
    matrix = np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])
    return View(SIDE_PX, SIDE_PX, matrix, rotation, -rotation @ (centre + back * distance))
