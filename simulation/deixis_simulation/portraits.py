"""Heads to fit and to check head pose on: any turn, any light, faces that no avatar has, and exact truth.

A clip shows one person at a few turns; a regression needs tens of thousands of heads, and more faces than there are avatars.
So each portrait warps its avatar's head smoothly (`warped_head`), tints it, may put glasses on it, and is taken from anywhere
around it. What a camera adds on top (blur, noise, size, crops) is left to who uses them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .arms import hanging_arm
from .avatars import WIGGED, Avatar, Picture, load_avatar
from .body import Body, fit_body, head_share
from .dice import Dice
from .draw_bodies import draw_bodies
from .geometry import Floats, View
from .mixed_heads import mixed_head, reduced
from .portrait_arms import direction_of, raised_arm
from .portrait_cameras import camera_bearing, camera_elevation_deg
from .portrait_props import with_glasses, with_something_before
from .renderer import FloatPicture, Renderer, Tints, over
from .rotations import about, unit
from .scene import Scene
from .skeleton import SIDES, Posture, Skeleton, solve
from .skinning import Mesh, skin
from .studio import behind, draw_camera, draw_rooms, empty_room, light_person
from .truth_head import MIRROR

SIDE_PX, SIDE_M = 96, 0.5
"""A portrait is a square of so many pixels and, at the head's distance, about so many metres."""
ROOMS = 24
VIEWS = 10
"""Portraits of one person in one light: posing and shadows cost more than a look."""
BUST_M = 0.4
"""So far below the base of the head a person is drawn."""
LANDMARKS = ("right_eye", "left_eye", "nose", "mouth", "chin", "right_ear", "left_ear", "crown")
_BUMPS, _BUMP_M, _BUMP_RADIUS_M = 6, 0.004, (0.02, 0.06)
_MIXED, _LONG_HAIR, _RAISED, _BEFORE = 0.9, 0.2, 0.3, 0.6
"""Shares of people whose heads are mixed, of those with long hair beyond chance, and of those who raise an arm; of the
portraits of these that show it at the face."""
_GLASSES, _HANDS = 0.2, 0.12
"""Shares of portraits with glasses, and with something before the face."""
_NEAR_M, _FAR_M = 0.8, 5.0
"""How far cameras are from heads; by as much as an arm reaches farther where it is raised."""


@dataclass(frozen=True)
class Portrait:
    """A square picture of a head, and how it is turned.

    picture: (SIDE_PX, SIDE_PX, 3) BGR. rotation: (3, 3) of head axes to camera axes (x right, y down, z ahead) where the head
    is on the camera's axis: identity for one that looks into the camera. landmarks_px: (8, 2) of LANDMARKS, seen or not, the
    persons's own sides. centre_px: middle of the skull. breadth_px: ear to ear, as from the front.
    """

    picture: Picture
    rotation: Floats
    landmarks_px: Floats
    centre_px: Floats
    breadth_px: float


def portraits(seed: int, avatars: Sequence[str], count: int, rooms: int = ROOMS) -> Iterator[Portrait]:
    """So many portraits of people made from these avatars, in so many rooms; the same for the same arguments.

    Raises RenderError; AvatarError for fewer than two avatars.
    """
    rng = np.random.default_rng(seed)
    scenes = draw_rooms(rng, rooms)
    pictures = [empty_room(scene) for scene in scenes]
    studios: dict[str, Renderer] = {}
    made = 0
    try:
        while made < count:
            scene = scenes[int(rng.integers(len(scenes)))]
            for portrait in _sitting(rng, avatars, scene, pictures, studios, min(VIEWS, count - made)):
                made += 1
                yield portrait
    finally:
        for studio in studios.values():
            studio.close()


def warped_head(body: Body, rng: np.random.Generator) -> Body:
    """The body with another head: stretched along its axes and with smooth bumps, nearly the same on both sides."""
    share = head_share(body.avatar)[:, None]
    middle = body.head_centre
    stretch = 1 + rng.normal(0, [0.06, 0.06, 0.06])
    offset = (body.vertices - middle) * (stretch - 1)
    at = body.vertices - middle
    for _ in range(_BUMPS):
        place = unit(rng.normal(size=3)) * 0.1 * body.head_scale
        radius, height = rng.uniform(*_BUMP_RADIUS_M), rng.normal(0, _BUMP_M, 3)
        for mirror in (np.ones(3), np.array([-1.0, 1.0, 1.0])):
            near = np.exp(-0.5 * np.sum((at - place * mirror) ** 2, axis=1) / radius**2)
            offset += near[:, None] * height * mirror * rng.uniform(0.85, 1.15)
    hair = body.avatar.is_hair & (body.avatar.part == 1)
    offset[hair] += (at * rng.uniform(-0.02, 0.1))[hair]
    moved = (body.vertices + share * offset).astype(np.float32)
    return replace(body, vertices=moved)


# --- one person -----------------------------------------------------------------------------------------------------------


def _sitting(
    rng: np.random.Generator,
    avatars: Sequence[str],
    scene: Scene,
    rooms: Sequence[FloatPicture],
    studios: dict[str, Renderer],
    count: int,
) -> Iterator[Portrait]:
    dice = Dice(rng)
    drawn = draw_bodies(dice, avatars, 1)[0]
    base = WIGGED if WIGGED in avatars and rng.random() < _LONG_HAIR else drawn.avatar
    avatar = mixed_head(base, avatars, rng) if rng.random() < _MIXED else reduced(load_avatar(base))
    body = warped_head(fit_body(avatar, drawn.height_m), rng)
    posture, hand = _posture(rng, body), None
    if rng.random() < _RAISED:
        side, posture.arms[side], hand = raised_arm(rng, body)
    skeleton = solve(body, posture)
    mesh = skin(skeleton, posture.morphs)
    studio = _studio(avatar, studios)
    studio.repaint(0, avatar)
    studio.tint(0, Tints(drawn.skin_tint, drawn.hair_tint, drawn.clothes_tint))
    light_person(studio, scene.light, dice, skeleton, mesh)
    sensor = draw_camera(scene, dice, SIDE_PX)
    for number in range(count):
        view = _view(rng, skeleton, posture, hand)
        picture = over(studio.people(view, smooth=number % 4 == 0), behind(rng, rooms, SIDE_PX))
        if number == 0:
            sensor.meter(picture)
        yield _portrait(rng, sensor.expose(picture, number, float(rng.uniform(0.6, 1.5))), skeleton, mesh, view)


def _studio(avatar: Avatar, studios: dict[str, Renderer]) -> Renderer:
    """The renderer of that avatar: its pictures take longer to load than a dozen portraits."""
    if avatar.name not in studios:
        studios[avatar.name] = Renderer(SIDE_PX, SIDE_PX)
        studios[avatar.name].add_person(_bust(avatar), Tints())
    studios[avatar.name].take_over()
    return studios[avatar.name]


def _bust(avatar: Avatar) -> Avatar:
    """The avatar without what no portrait shows."""
    seen = avatar.vertices[:, 1] > avatar.joint("Head")[1] - BUST_M
    return replace(avatar, triangles=avatar.triangles[seen[avatar.triangles].any(axis=1)])


def _posture(rng: np.random.Generator, body: Body) -> Posture:
    neck = float(np.clip(rng.normal(0, 32), -75, 75))
    lids = float(rng.uniform(0.4, 1)) if rng.random() < 0.15 else 0.0
    morphs = dict.fromkeys(("LeyeClose", "ReyeClose"), lids)
    if rng.random() < 0.4:
        morphs[str(rng.choice(["MouthOpen", "AE_AA", "UH_OO"]))] = float(rng.uniform(0.1, 1))
    return Posture(
        arms={side: hanging_arm(body, side, *rng.uniform(-0.02, 0.02, 3)) for side in SIDES},
        spine=(0.0, float(rng.normal(2, 5)), float(rng.normal(0, 3))),
        head=(neck, float(np.clip(rng.normal(-4, 12), -35, 30)), float(np.clip(rng.normal(0, 7), -25, 25))),
        gaze=(float(np.clip(rng.normal(0, 12), -28, 28)), float(rng.normal(0, 6))),
        morphs=morphs,
    )


def _view(rng: np.random.Generator, skeleton: Skeleton, posture: Posture, hand: Floats | None) -> View:
    """A camera that looks at the head from anywhere around it: four in five times not farther than 135 degrees aside.

    `hand`: bearing of a raised one, which often comes between.
    """
    yaw = float(rng.uniform(-135, 135) if rng.random() < 0.8 else rng.uniform(-180, 180))
    bearing = np.array([posture.head[0] - yaw, camera_elevation_deg(rng)])
    if hand is not None and rng.random() < _BEFORE:
        bearing = camera_bearing(rng, hand)
    roll = float(np.clip(rng.normal(0, 6), -20, 20))
    back = direction_of(bearing)
    body = skeleton.body
    distance = float(np.exp(rng.uniform(np.log(_NEAR_M + (0.4 if hand is not None else 0)), np.log(_FAR_M))))
    centre = skeleton.carried("Head", body.head_centre)
    eye = centre + back * distance
    across = unit(np.cross([0.0, 1.0, 0.0], back))
    rotation = about([0.0, 0.0, 1.0], roll) @ np.stack([across, -np.cross(back, across), -back])
    focal = SIDE_PX / SIDE_M * distance / body.head_scale * float(rng.uniform(0.92, 1.08))
    middle = (SIDE_PX - 1) / 2 + rng.uniform(-4, 4, 2)
    matrix = np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])
    return View(SIDE_PX, SIDE_PX, matrix, rotation, -rotation @ eye)


def _portrait(rng: np.random.Generator, picture: Picture, skeleton: Skeleton, mesh: Mesh, view: View) -> Portrait:
    body = skeleton.body
    centre = skeleton.carried("Head", body.head_centre)
    in_camera = MIRROR @ view.rotation @ skeleton.rotation("Head")
    places, breadth_m = _landmarks(body.avatar, skeleton, mesh)
    depth = float(view.in_camera(centre)[2])
    if rng.random() < _GLASSES:
        picture = with_glasses(rng, picture, skeleton, view)
    if rng.random() < _HANDS:
        picture = with_something_before(rng, picture)
    return Portrait(
        picture=picture,
        rotation=MIRROR @ in_camera @ MIRROR,
        landmarks_px=view.project(places),
        centre_px=view.project(centre),
        breadth_px=breadth_m * view.matrix[0, 0] / depth,
    )


def _landmarks(avatar: Avatar, skeleton: Skeleton, mesh: Mesh) -> tuple[Floats, float]:
    """Places (8, 3) of LANDMARKS, world, and the breadth of the head ear to ear, metres."""
    rows = avatar.head_vertices
    at = avatar.vertices[rows] - avatar.eyes
    face = (at[:, 1] > -0.13) & (at[:, 1] < 0.0)
    ears = face & (at[:, 2] < -0.03)
    picks = {
        "nose": rows[np.argmax(np.where(face & (at[:, 1] > -0.06), at[:, 2], -9))],
        "mouth": rows[np.argmin(np.hypot(at[:, 0], at[:, 1] + 0.068) + np.where(at[:, 2] < -0.02, 9, 0))],
        "chin": rows[np.argmin(np.where((np.abs(at[:, 0]) < 0.02) & (at[:, 2] > -0.06), at[:, 1], 9))],
        "right_ear": rows[np.argmin(np.where(ears, at[:, 0], 9))],
        "left_ear": rows[np.argmax(np.where(ears, at[:, 0], -9))],
        "crown": rows[np.argmax(at[:, 1])],
    }
    found = {name: mesh.vertices[row].astype(float) for name, row in picks.items()}
    found["right_eye"], found["left_eye"] = skeleton.position("RightEye"), skeleton.position("LeftEye")
    breadth = float(np.linalg.norm(found["left_ear"] - found["right_ear"]))
    return np.array([found[name] for name in LANDMARKS]), breadth
