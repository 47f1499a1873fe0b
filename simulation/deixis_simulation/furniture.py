"""Furniture at the wall that the camera looks at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from . import textures
from .geometry import to_world
from .scene import Furniture, Room, Tone
from .shapes import box, lathe, plant, quad, sphere
from .surface import Surface, linear_tint

Rng = np.random.Generator

WOOD: Tone = (150, 104, 66)
VASE = [(0.001, 0), (0.07, 0), (0.11, 0.1), (0.1, 0.2), (0.05, 0.27), (0.065, 0.32), (0.055, 0.31)]


def build_furniture(item: Furniture, room: Room, rng: Rng) -> list[Surface]:
    """Pieces in the frame of the wall (x along it, y up, z into the room), then placed at the wall."""
    made = _MAKERS[item.kind](item.tone, rng)
    corner = to_world((room.front_x_m - 0.03 - item.off_wall_m, item.along_m))
    return [surface.placed(corner) for surface in made]


def _door(tone: Tone | None, rng: Rng) -> list[Surface]:
    frame = (0.45, 0.40, 0.36)
    return [
        Surface(
            box((0, 1.03, 0.02), (0.9, 2.06, 0.05)),
            textures.wood(tone or (186, 126, 84), rng, planks=2),
            roughness=0.45,
            gloss=0.35,
        ),
        Surface(box((0, 2.1, 0.02), (1.06, 0.09, 0.09)), tint=frame),
        Surface(box((-0.49, 1.05, 0.02), (0.08, 2.1, 0.09)), tint=frame),
        Surface(box((0.49, 1.05, 0.02), (0.08, 2.1, 0.09)), tint=frame),
        Surface(sphere((0.38, 1.02, 0.08), 0.028), tint=(0.6, 0.55, 0.4), roughness=0.25, gloss=2.0),
    ]


def _cabinet(tone: Tone | None, rng: Rng) -> list[Surface]:
    return [
        Surface(
            box((0, 0.5, 0.24), (1.2, 1.0, 0.42)),
            textures.wood(tone or (190, 134, 92), rng, planks=2),
            roughness=0.5,
            gloss=0.3,
        ),
        Surface(box((0, 0.52, 0.455), (0.012, 0.9, 0.01)), tint=(0.15, 0.1, 0.07)),
        Surface(lathe((0.35, 1.0, 0.22), VASE), tint=(0.10, 0.22, 0.35), roughness=0.25, gloss=1.2),
        Surface(box((-0.3, 1.03, 0.22), (0.3, 0.06, 0.22), 12), tint=(0.55, 0.12, 0.1)),
    ]


def _shelf(tone: Tone | None, rng: Rng) -> list[Surface]:
    planks = textures.wood(tone or WOOD, rng, planks=1)
    return [
        Surface(box((0, 1.0, 0.15), (1.1, 2.0, 0.28)), tint=(0.12, 0.08, 0.05)),
        Surface(
            quad((-0.5, 0.05, 0.292), (1.0, 0, 0), (0, 1.9, 0)),
            textures.books(rng),
            roughness=0.7,
            gloss=0.15,
            casts_shadow=False,
        ),
        Surface(box((-0.54, 1.0, 0.16), (0.05, 2.0, 0.3)), planks),
        Surface(box((0.54, 1.0, 0.16), (0.05, 2.0, 0.3)), planks),
        Surface(box((0, 2.0, 0.16), (1.13, 0.05, 0.3)), planks),
    ]


def hung(picture: textures.Picture, width: float, height: float, bottom: float) -> list[Surface]:
    """A framed picture at a wall, x along it, its lower edge at `bottom`."""
    middle = bottom + height / 2
    return [
        Surface(
            box((0, middle, 0.01), (width + 0.06, height + 0.06, 0.035)), tint=(0.08, 0.07, 0.06), roughness=0.4, gloss=0.4
        ),
        Surface(
            quad((-width / 2, bottom, 0.032), (width, 0, 0), (0, height, 0)),
            picture,
            roughness=0.35,
            gloss=0.3,
            casts_shadow=False,
        ),
    ]


def _board(_: Tone | None, rng: Rng) -> list[Surface]:
    return hung(textures.board(rng), 1.54, 0.94, 1.03)


def _poster(tone: Tone | None, rng: Rng) -> list[Surface]:
    return hung(textures.poster(tone or (30, 70, 120), rng), 0.55, 0.78, 1.3)


def _plant(tone: Tone | None, rng: Rng) -> list[Surface]:
    pot = [(0.001, 0), (0.13, 0), (0.19, 0.36), (0.2, 0.38), (0.17, 0.37), (0.15, 0.34), (0.001, 0.34)]
    return [
        Surface(lathe((0, 0, 0.4), pot), tint=linear_tint(tone or (190, 148, 128)), roughness=0.7),
        Surface(plant((0, 0.34, 0.4), 0.8, rng), textures.plaster((58, 110, 46), rng, 128, 0.15), roughness=0.45, gloss=0.4),
    ]


def _window(_: Tone | None, __: Rng) -> list[Surface]:
    frame = (0.85, 0.85, 0.83)
    slats = [
        Surface(box((0, 0.99 + 0.07 * n, 0.05), (1.2, 0.018, 0.03)), tint=(0.8, 0.8, 0.78), casts_shadow=False)
        for n in range(18)
    ]
    return [
        Surface(
            quad((-0.6, 0.95, 0.02), (1.2, 0, 0), (0, 1.25, 0)), tint=(0, 0, 0), emission=(1.9, 2.1, 2.4), casts_shadow=False
        ),
        *slats,
        Surface(box((0, 0.93, 0.06), (1.34, 0.05, 0.14)), tint=frame),
        Surface(box((0, 2.22, 0.04), (1.34, 0.06, 0.08)), tint=frame),
        Surface(box((-0.63, 1.58, 0.04), (0.06, 1.3, 0.06)), tint=frame),
        Surface(box((0.63, 1.58, 0.04), (0.06, 1.3, 0.06)), tint=frame),
    ]


def _cardboard(tone: Tone | None, rng: Rng) -> list[Surface]:
    look = textures.plaster(tone or (182, 138, 98), rng, 128, 0.05)
    return [
        Surface(box((0, 0.2, 0.3), (0.5, 0.4, 0.4), 18), look),
        Surface(box((0.05, 0.53, 0.32), (0.38, 0.26, 0.3), -12), look),
    ]


def _bench(tone: Tone | None, rng: Rng) -> list[Surface]:
    planks = textures.wood(tone or (170, 122, 82), rng)
    legs = [Surface(box((x, 0.21, 0.3), (0.06, 0.42, 0.36)), tint=(0.2, 0.2, 0.2)) for x in (-0.6, 0.6)]
    return [Surface(box((0, 0.44, 0.3), (1.5, 0.05, 0.42)), planks, roughness=0.45, gloss=0.3), *legs]


def _column(tone: Tone | None, rng: Rng) -> list[Surface]:
    look = textures.plaster(tone or (206, 198, 184), rng, 256)
    return [Surface(lathe((0, 0, 0.3), [(0.25, 0), (0.25, 0.1), (0.18, 0.14), (0.16, 2.9), (0.24, 3.0)]), look, roughness=0.8)]


_MAKERS: dict[str, Callable[[Tone | None, Rng], list[Surface]]] = {
    "door": _door,
    "cabinet": _cabinet,
    "books": _shelf,
    "board": _board,
    "poster": _poster,
    "plant": _plant,
    "window": _window,
    "cardboard": _cardboard,
    "bench": _bench,
    "column": _column,
}
