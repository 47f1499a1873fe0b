"""What stands in a scene besides people: walls and floor, furniture, and the exhibits of the POIs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from . import textures
from .exhibits import build_exhibit
from .furniture import build_furniture
from .geometry import Floats, robot_at, to_world, view_at
from .scene import Person, Place, Room, Scene, ScenePoi, Tone, Walk
from .shapes import Shape, box, quad
from .surface import Surface

Rng = np.random.Generator

TOO_NEAR_CAMERA_M = 0.9
SIDE_TEXTURE_M = 3.4
"""What one picture of a plain wall covers."""
WALL_THICKNESS_M = 0.08
LEG_STEPS = 5
"""Places of the camera that are looked at between two waypoints, and one more."""


def build_room(scene: Scene) -> list[Surface]:
    """Everything that stands still in a scene. Details of the textures come from the scene's seed."""
    rng = np.random.default_rng([scene.seed, 3])
    surfaces = _walls(scene.room, rng) + _site_walls(scene.room, rng)
    for item in scene.room.furniture:
        surfaces += build_furniture(item, scene.room, rng)
    for number, poi in enumerate(scene.pois):
        if is_drawn(poi, scene):
            surfaces += build_exhibit(poi, number, rng)
    return surfaces


def is_drawn(poi: ScenePoi, scene: Scene) -> bool:
    """Whether the POI's exhibit is drawn: it must stand in the room, and neither at the lens nor before a person.

    The lens is looked at wherever the robot goes, people where they come to stand; who walks may pass behind an exhibit.
    """
    room, (x, y, _) = scene.room, poi.position_m
    inside = room.back_x_m < x < room.front_x_m - 0.2 and room.right_y_m + 0.2 < y < room.left_y_m - 0.2
    if poi.exhibit is None or not inside:
        return False
    place = to_world((x, y, 0.0))
    cameras = _camera_places(scene)
    if any(math.hypot(place[0] - camera[0], place[2] - camera[2]) < TOO_NEAR_CAMERA_M for camera in cameras):
        return False
    people = [to_world(stand) for person in scene.people for stand in _standing_places(person)]
    return not any(_stands_before(place, person, camera) for person in people for camera in cameras)


def _camera_places(scene: Scene) -> list[Floats]:
    """Where the lens is (world), leg by leg of the robot's path."""
    path = scene.robot_path
    times = [point.at_s for point in path] or [0.0]
    between = [a + (b - a) * step / LEG_STEPS for a, b in pairwise(times) for step in range(1, LEG_STEPS)]
    return [view_at(scene.camera, robot_at(path, time_s)).centre for time_s in (*times, *between)]


def _standing_places(person: Person) -> list[Place]:
    return [person.place_m, *(action.to_m for action in person.actions if isinstance(action, Walk))]


def _stands_before(place: Floats, person: Floats, camera: Floats) -> bool:
    """Whether `place` hides part of the person: nearer to the camera, and close to the line of sight (from above)."""
    sight, there = (person - camera)[[0, 2]], (place - camera)[[0, 2]]
    reach = float(np.linalg.norm(sight))
    along = float(there @ sight) / max(reach, 1e-6)
    aside = abs(float(sight[0] * there[1] - sight[1] * there[0])) / max(reach, 1e-6) if reach else math.inf
    return -0.3 < along < reach + 0.5 and aside < 0.75


# --- walls ------------------------------------------------------------------------------------------------------------


def _wall_texture(kind: str, tone: Tone, rng: Rng) -> tuple[textures.Picture, float]:
    """Texture of a wall, and how many metres it covers."""
    makers: dict[str, tuple[Callable[[Tone, Rng], textures.Picture], float]] = {
        "plaster": (textures.plaster, SIDE_TEXTURE_M),
        "brick": (textures.brick, 1.15),
        "wood": (textures.wood, 0.9),
        "panel": (textures.panels, 2.4),
    }
    make, metres = makers[kind]
    return make(tone, rng), metres


def _walls(room: Room, rng: Rng) -> list[Surface]:
    front, back, left, right, height = room.front_x_m, room.back_x_m, room.left_y_m, room.right_y_m, room.ceiling_m
    wide, deep = left - right, front - back
    look, metres = _wall_texture(room.wall, room.wall_tone, rng)
    side = textures.plaster(room.side_tone, rng)
    floor, per = _floor(room, rng)
    up = np.array((0.0, height, 0.0))
    across, toward = to_world((0, -wide)), to_world((-deep, 0))
    lamps = [
        Surface(
            quad(to_world((x, y + 0.55, height - 0.01)), (1.1, 0, 0), (0, 0, -0.28)),
            tint=(0, 0, 0),
            emission=(3.2, 3.2, 3.0),
            casts_shadow=False,
        )
        for x in (0.8, 2.8)
        for y in (-1.1, 1.1)
    ]
    sideways = deep / SIDE_TEXTURE_M, height / SIDE_TEXTURE_M
    behind = wide / SIDE_TEXTURE_M, height / SIDE_TEXTURE_M
    ceiling = quad(to_world((front, left, height)), across, toward)
    return [
        _plane(quad(to_world((front, left)), across, up, (wide / metres, height / metres)), look, gloss=0.06),
        _plane(quad(to_world((back, left)), -toward, up, sideways), side),
        _plane(quad(to_world((front, right)), toward, up, sideways), side),
        _plane(quad(to_world((back, right)), -across, up, behind), side),
        _plane(quad(to_world((back, left)), across, -toward, (wide / per, deep / per)), floor, roughness=0.5, gloss=0.35),
        Surface(ceiling, tint=(0.9, 0.9, 0.88), emission=(0.17, 0.168, 0.16), casts_shadow=False),
        *lamps,
    ]


def _plane(shape: Shape, texture: textures.Picture, roughness: float = 0.9, gloss: float = 0.05) -> Surface:
    """A side of the room: it is outside of all lamps, and would only throw shadows on itself."""
    return Surface(shape, texture, roughness=roughness, gloss=gloss, casts_shadow=False)


def _floor(room: Room, rng: Rng) -> tuple[textures.Picture, float]:
    if room.floor == "wood":
        return textures.wood(room.floor_tone, rng, planks=8, size=1024), 2.6
    if room.floor == "carpet":
        return textures.carpet(room.floor_tone, rng), 1.5
    return textures.plaster(room.floor_tone, rng, rough=0.06), 3.0


def _site_walls(room: Room, rng: Rng) -> list[Surface]:
    """Walls of a site that do not run along the room's own."""
    look = textures.plaster(room.wall_tone, rng)
    surfaces = []
    for start, end in room.walls:
        if _along_the_room(start, end, room):
            continue
        a, b = to_world(start), to_world(end)
        length = float(np.linalg.norm(b - a))
        if length < 1e-3:
            continue
        turn = math.degrees(math.atan2(-(b - a)[2], (b - a)[0]))
        centre = (a + b) / 2 + np.array((0.0, room.ceiling_m / 2, 0.0))
        wall = box(centre, (length, room.ceiling_m, WALL_THICKNESS_M), turn)
        # No shadow: each room of a site has lamps of its own, here there are those around the people alone.
        surfaces.append(Surface(wall, look, roughness=0.9, gloss=0.05, casts_shadow=False))
    return surfaces


def _along_the_room(start: Sequence[float], end: Sequence[float], room: Room) -> bool:
    at_x = any(abs(start[0] - x) < 0.05 and abs(end[0] - x) < 0.05 for x in (room.front_x_m, room.back_x_m))
    at_y = any(abs(start[1] - y) < 0.05 and abs(end[1] - y) < 0.05 for y in (room.left_y_m, room.right_y_m))
    return at_x or at_y
