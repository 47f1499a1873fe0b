"""What stands in a scene besides people: walls, floor, furniture, and the exhibits of the POIs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from . import textures
from .geometry import Floats, robot_at, to_world, view_at
from .scene import Furniture, Room, Scene, ScenePoi, Tone
from .shapes import Shape, box, lathe, placed, plant, quad, sphere

Rng = np.random.Generator

PLINTH_M = 0.32
BELOW_POI_M = 0.16
"""An exhibit is about twice this high; the POI is its middle."""
TOO_NEAR_CAMERA_M = 0.9
WALL_THICKNESS_M = 0.08
WOOD: Tone = (150, 104, 66)


@dataclass(frozen=True)
class Surface:
    """A shape with its look. `texture` None: white; tint multiplies it (linear); `emission` is light of its own."""

    shape: Shape
    texture: textures.Picture | None = None
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    roughness: float = 0.8
    gloss: float = 0.1
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    casts_shadow: bool = True


def build_room(scene: Scene) -> list[Surface]:
    """Everything that stands still in a scene. Details of the textures come from the scene's seed."""
    rng = np.random.default_rng([scene.seed, 3])
    surfaces = _walls(scene.room, rng) + _site_walls(scene.room, rng)
    for item in scene.room.furniture:
        surfaces += _furniture(item, scene.room, rng)
    for number, poi in enumerate(scene.pois):
        if is_drawn(poi, scene):
            surfaces += _exhibit(poi, number, rng)
    return surfaces


def is_drawn(poi: ScenePoi, scene: Scene) -> bool:
    """Whether the POI's exhibit is drawn: it must stand in the room, and neither at the lens nor before a person."""
    room, (x, y, _) = scene.room, poi.position_m
    inside = room.back_x_m < x < room.front_x_m - 0.2 and room.right_y_m + 0.2 < y < room.left_y_m - 0.2
    if poi.exhibit is None or not inside:
        return False
    camera = view_at(scene.camera, robot_at(scene.robot_path, 0.0)).centre
    place = to_world((x, y, 0.0))
    if math.hypot(place[0] - camera[0], place[2] - camera[2]) < TOO_NEAR_CAMERA_M:
        return False
    return not any(_stands_before(place, to_world((*person.place_m, 0.0)), camera) for person in scene.people)


def _stands_before(place: Floats, person: Floats, camera: Floats) -> bool:
    """Whether `place` hides part of the person: nearer to the camera, and close to the line of sight (from above)."""
    sight, there = (person - camera)[[0, 2]], (place - camera)[[0, 2]]
    reach = float(np.linalg.norm(sight))
    along = float(there @ sight) / max(reach, 1e-6)
    aside = abs(float(np.cross(sight, there))) / max(reach, 1e-6) if reach else math.inf
    return -0.3 < along < reach + 0.5 and aside < 0.75


# --- walls ------------------------------------------------------------------------------------------------------------


def _wall_texture(kind: str, tone: Tone, rng: Rng) -> tuple[textures.Picture, float]:
    """Texture of a wall, and how many metres it covers."""
    makers: dict[str, tuple[Callable[[Tone, Rng], textures.Picture], float]] = {
        "plaster": (textures.plaster, 3.4),
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
        Surface(quad(to_world((x, y + 0.55, height - 0.01)), (1.1, 0, 0), (0, 0, -0.28)), None, (0, 0, 0), emission=(3.2, 3.2, 3.0),
                casts_shadow=False)
        for x in (0.8, 2.8) for y in (-1.1, 1.1)
    ]  # fmt: skip
    return [
        Surface(quad(to_world((front, left)), across, up, (wide / metres, height / metres)), look, (1, 1, 1), 0.9, 0.06, casts_shadow=False),
        Surface(quad(to_world((back, left)), -toward, up, (deep / 3.4, height / 3.4)), side, (1, 1, 1), 0.9, 0.05, casts_shadow=False),
        Surface(quad(to_world((front, right)), toward, up, (deep / 3.4, height / 3.4)), side, (1, 1, 1), 0.9, 0.05, casts_shadow=False),
        Surface(quad(to_world((back, right)), -across, up, (wide / 3.4, height / 3.4)), side, (1, 1, 1), 0.9, 0.05, casts_shadow=False),
        Surface(quad(to_world((back, left)), across, -toward, (wide / per, deep / per)), floor, (1, 1, 1), 0.5, 0.35, casts_shadow=False),
        Surface(quad(to_world((front, left, height)), across, toward), None, (0.9, 0.9, 0.88), emission=(0.17, 0.168, 0.16), casts_shadow=False),
        *lamps,
    ]  # fmt: skip


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
        surfaces.append(Surface(box(centre, (length, room.ceiling_m, WALL_THICKNESS_M), turn), look, roughness=0.9, gloss=0.05))
    return surfaces


def _along_the_room(start: Sequence[float], end: Sequence[float], room: Room) -> bool:
    at_x = any(abs(start[0] - x) < 0.05 and abs(end[0] - x) < 0.05 for x in (room.front_x_m, room.back_x_m))
    at_y = any(abs(start[1] - y) < 0.05 and abs(end[1] - y) < 0.05 for y in (room.left_y_m, room.right_y_m))
    return at_x or at_y


# --- furniture --------------------------------------------------------------------------------------------------------


def _furniture(item: Furniture, room: Room, rng: Rng) -> list[Surface]:
    """Pieces in the frame of the wall (x along it, y up, z into the room), then placed at the wall."""
    made = _MAKERS[item.kind](item.tone, rng)
    corner = to_world((room.front_x_m - 0.03 - item.off_wall_m, item.along_m))
    return [Surface(**{**vars(surface), "shape": placed(surface.shape, corner)}) for surface in made]


def _linear(tone: Tone) -> tuple[float, float, float]:
    red, green, blue = ((value / 255) ** 2.2 for value in tone)
    return red, green, blue


def _door(tone: Tone | None, rng: Rng) -> list[Surface]:
    frame = (0.45, 0.40, 0.36)
    return [
        Surface(box((0, 1.03, 0.02), (0.9, 2.06, 0.05)), textures.wood(tone or (186, 126, 84), rng, planks=2), roughness=0.45, gloss=0.35),
        Surface(box((0, 2.1, 0.02), (1.06, 0.09, 0.09)), tint=frame),
        Surface(box((-0.49, 1.05, 0.02), (0.08, 2.1, 0.09)), tint=frame),
        Surface(box((0.49, 1.05, 0.02), (0.08, 2.1, 0.09)), tint=frame),
        Surface(sphere((0.38, 1.02, 0.08), 0.028), tint=(0.6, 0.55, 0.4), roughness=0.25, gloss=2.0),
    ]


def _cabinet(tone: Tone | None, rng: Rng) -> list[Surface]:
    return [
        Surface(box((0, 0.5, 0.24), (1.2, 1.0, 0.42)), textures.wood(tone or (190, 134, 92), rng, planks=2), roughness=0.5, gloss=0.3),
        Surface(box((0, 0.52, 0.455), (0.012, 0.9, 0.01)), tint=(0.15, 0.1, 0.07)),
        Surface(lathe((0.35, 1.0, 0.22), VASE), tint=(0.10, 0.22, 0.35), roughness=0.25, gloss=1.2),
        Surface(box((-0.3, 1.03, 0.22), (0.3, 0.06, 0.22), 12), tint=(0.55, 0.12, 0.1)),
    ]


def _shelf(tone: Tone | None, rng: Rng) -> list[Surface]:
    planks = textures.wood(tone or WOOD, rng, planks=1)
    return [
        Surface(box((0, 1.0, 0.15), (1.1, 2.0, 0.28)), tint=(0.12, 0.08, 0.05)),
        Surface(quad((-0.5, 0.05, 0.292), (1.0, 0, 0), (0, 1.9, 0)), textures.books(rng), roughness=0.7, gloss=0.15, casts_shadow=False),
        Surface(box((-0.54, 1.0, 0.16), (0.05, 2.0, 0.3)), planks),
        Surface(box((0.54, 1.0, 0.16), (0.05, 2.0, 0.3)), planks),
        Surface(box((0, 2.0, 0.16), (1.13, 0.05, 0.3)), planks),
    ]


def _hung(picture: textures.Picture, width: float, height: float, bottom: float) -> list[Surface]:
    middle = bottom + height / 2
    return [
        Surface(box((0, middle, 0.01), (width + 0.06, height + 0.06, 0.035)), tint=(0.08, 0.07, 0.06), roughness=0.4, gloss=0.4),
        Surface(quad((-width / 2, bottom, 0.032), (width, 0, 0), (0, height, 0)), picture, roughness=0.35, gloss=0.3, casts_shadow=False),
    ]


def _board(_: Tone | None, rng: Rng) -> list[Surface]:
    return _hung(textures.board(rng), 1.54, 0.94, 1.03)


def _poster(tone: Tone | None, rng: Rng) -> list[Surface]:
    return _hung(textures.poster(tone or (30, 70, 120), rng), 0.55, 0.78, 1.3)


def _plant(tone: Tone | None, rng: Rng) -> list[Surface]:
    pot = [(0.001, 0), (0.13, 0), (0.19, 0.36), (0.2, 0.38), (0.17, 0.37), (0.15, 0.34), (0.001, 0.34)]
    return [
        Surface(lathe((0, 0, 0.4), pot), tint=_linear(tone or (190, 148, 128)), roughness=0.7),
        Surface(plant((0, 0.34, 0.4), 0.8, rng), textures.plaster((58, 110, 46), rng, 128, 0.15), roughness=0.45, gloss=0.4),
    ]


def _window(_: Tone | None, __: Rng) -> list[Surface]:
    frame = (0.85, 0.85, 0.83)
    slats = [Surface(box((0, 0.99 + 0.07 * n, 0.05), (1.2, 0.018, 0.03)), tint=(0.8, 0.8, 0.78), casts_shadow=False) for n in range(18)]
    return [
        Surface(quad((-0.6, 0.95, 0.02), (1.2, 0, 0), (0, 1.25, 0)), tint=(0, 0, 0), emission=(1.9, 2.1, 2.4), casts_shadow=False),
        *slats,
        Surface(box((0, 0.93, 0.06), (1.34, 0.05, 0.14)), tint=frame),
        Surface(box((0, 2.22, 0.04), (1.34, 0.06, 0.08)), tint=frame),
        Surface(box((-0.63, 1.58, 0.04), (0.06, 1.3, 0.06)), tint=frame),
        Surface(box((0.63, 1.58, 0.04), (0.06, 1.3, 0.06)), tint=frame),
    ]


def _cardboard(tone: Tone | None, rng: Rng) -> list[Surface]:
    look = textures.plaster(tone or (182, 138, 98), rng, 128, 0.05)
    return [Surface(box((0, 0.2, 0.3), (0.5, 0.4, 0.4), 18), look), Surface(box((0.05, 0.53, 0.32), (0.38, 0.26, 0.3), -12), look)]


def _bench(tone: Tone | None, rng: Rng) -> list[Surface]:
    planks = textures.wood(tone or (170, 122, 82), rng)
    legs = [Surface(box((x, 0.21, 0.3), (0.06, 0.42, 0.36)), tint=(0.2, 0.2, 0.2)) for x in (-0.6, 0.6)]
    return [Surface(box((0, 0.44, 0.3), (1.5, 0.05, 0.42)), planks, roughness=0.45, gloss=0.3), *legs]


def _column(tone: Tone | None, rng: Rng) -> list[Surface]:
    look = textures.plaster(tone or (206, 198, 184), rng, 256)
    return [Surface(lathe((0, 0, 0.3), [(0.25, 0), (0.25, 0.1), (0.18, 0.14), (0.16, 2.9), (0.24, 3.0)]), look, roughness=0.8)]


_MAKERS: dict[str, Callable[[Tone | None, Rng], list[Surface]]] = {
    "door": _door, "cabinet": _cabinet, "books": _shelf, "board": _board, "poster": _poster, "plant": _plant, "window": _window,
    "cardboard": _cardboard, "bench": _bench, "column": _column,
}  # fmt: skip


# --- exhibits ---------------------------------------------------------------------------------------------------------

VASE = [(0.001, 0), (0.07, 0), (0.11, 0.1), (0.1, 0.2), (0.05, 0.27), (0.065, 0.32), (0.055, 0.31)]
CUP = [(0.14, 0), (0.12, 0.02), (0.03, 0.05), (0.03, 0.12), (0.1, 0.2), (0.15, 0.3), (0.14, 0.3)]
BUST = [(0.10, 0), (0.09, 0.03), (0.13, 0.07), (0.15, 0.11), (0.06, 0.15), (0.055, 0.18), (0.09, 0.22), (0.1, 0.27), (0.06, 0.33), (0.001, 0.34)]


def _exhibit(poi: ScenePoi, number: int, rng: Rng) -> list[Surface]:
    x, y, z = poi.position_m
    foot = max(z - BELOW_POI_M, 0.0)
    base, top = to_world((x, y, 0.0)), to_world((x, y, foot))
    tint = _linear(poi.tone)
    if poi.exhibit == "picture":
        return _easel(base, z, textures.painting(rng))
    made = {
        "vase": Surface(lathe(top, VASE), None, tint, 0.25, 1.2),
        "sphere": Surface(sphere(top + (0, 0.15, 0), 0.14), None, tint, 0.35, 0.8),
        "cube": Surface(box(top + (0, 0.13, 0), (0.2, 0.26, 0.2), 35), None, tint, 0.5, 0.3),
        "cup": Surface(lathe(top, CUP), None, tint, 0.2, 1.5),
        "bust": Surface(lathe(top, BUST), None, tint, 0.7, 0.2),
    }[poi.exhibit or "cube"]
    if foot < 0.05:
        return [made]
    plinth = box(base + (0, foot / 2, 0), (PLINTH_M, foot, PLINTH_M), 20 * number)
    return [Surface(plinth, None, (0.72, 0.71, 0.69), 0.6, 0.15), made]


def _easel(base: Floats, height: float, picture: textures.Picture) -> list[Surface]:
    turn = math.degrees(math.atan2(-base[0], -base[2] if base[2] else 1e-6))
    hung = _hung(picture, 0.48, 0.36, height - 0.18)
    legs = [Surface(box((x, height / 2, -0.05), (0.03, height + 0.2, 0.03)), tint=(0.25, 0.17, 0.1)) for x in (-0.2, 0.2)]
    return [Surface(**{**vars(surface), "shape": placed(surface.shape, base, turn)}) for surface in (*legs, *hung)]
