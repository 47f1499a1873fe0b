"""The room around persons and exhibits: walls, floor, furniture, some of it in the colours of skin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from .dice import Dice
from .scene import FloorKind, Furniture, FurnitureKind, Place, Room, Tone, WallKind

FURNITURE: tuple[FurnitureKind, ...] = (
    "door", "cabinet", "books", "board", "poster", "plant", "window", "cardboard", "bench", "column",
)  # fmt: skip
SKIN_LIKE: tuple[Tone, ...] = ((222, 184, 150), (205, 160, 122), (186, 138, 100), (150, 104, 72), (214, 172, 140))
"""Beech, oak, cherry, walnut, and a beige paint: what a colour rule takes for skin."""
SKIN_LIKE_SHARE = 0.35
GAP_M = 1.3
"""Between pieces of furniture, from middle to middle."""


@dataclass(frozen=True)
class Rooms:
    """What rooms are made of, by weight. paints, floor_paints: of walls and floors of a kind, each a little darker or brighter;
    any colour where there are none. furniture_tinted: share in the colours of skin.
    """

    walls: Mapping[WallKind, float] = field(default_factory=lambda: {"plaster": 0.5, "brick": 0.15, "wood": 0.2, "panel": 0.15})
    floors: Mapping[FloorKind, float] = field(default_factory=lambda: {"wood": 0.45, "stone": 0.25, "carpet": 0.3})
    paints: Mapping[WallKind, Sequence[Tone]] = field(default_factory=dict)
    floor_paints: Mapping[FloorKind, Sequence[Tone]] = field(default_factory=dict)
    furniture: tuple[FurnitureKind, ...] = FURNITURE
    pieces: tuple[int, int] = (1, 5)
    furniture_tinted: float = 0.4


ANY_ROOMS = Rooms()


def draw_room(dice: Dice, reach: Sequence[Place], rooms: Rooms = ANY_ROOMS) -> Room:
    """A room that has all the places of `reach` (persons, exhibits, robot) inside, with some way to spare."""
    front = max([3.2, *(x for x, _ in reach)]) + dice.between(0.45, 2.0, 2)
    back = min([0.0, *(x for x, _ in reach)]) - dice.between(0.8, 3.0, 2)
    left = max([1.6, *(y for _, y in reach)]) + dice.between(0.45, 2.0, 2)
    right = min([-1.6, *(y for _, y in reach)]) - dice.between(0.45, 2.0, 2)
    wall = dice.weighed(rooms.walls)
    paints = rooms.paints.get(wall, ())
    tone = _draw_tone(dice, paints)
    side = tone if dice.chance(0.7) else _draw_tone(dice, paints)
    ceiling_m, floor = dice.between(2.5, 4.0, 2), dice.weighed(rooms.floors)
    return Room(
        front_x_m=round(front, 2),
        back_x_m=round(back, 2),
        left_y_m=round(left, 2),
        right_y_m=round(right, 2),
        ceiling_m=ceiling_m,
        wall=wall,
        wall_tone=tone,
        side_tone=side,
        floor=floor,
        floor_tone=_draw_floor_tone(dice, rooms.floor_paints.get(floor, ())),
        furniture=_draw_furniture(dice, round(right, 2), round(left, 2), rooms),
    )


def _draw_tone(dice: Dice, paints: Sequence[Tone]) -> Tone:
    """Of a wall: one of these, or skin-like, or a light paint with a slight hue, or a strong one."""
    if paints:
        return _shaded(dice, paints)
    skin_like, light = dice.one(SKIN_LIKE), dice.whole(140, 225)
    plain = (light, light - dice.whole(0, 12), light - dice.whole(0, 26))
    strong = (dice.whole(40, 200), dice.whole(50, 190), dice.whole(50, 200))
    return dice.weighed({skin_like: SKIN_LIKE_SHARE, plain: 0.5, strong: 0.15})


def _shaded(dice: Dice, paints: Sequence[Tone]) -> Tone:
    (red, green, blue), shade = dice.one(paints), dice.between(0.9, 1.1)
    return round(red * shade), round(green * shade), round(blue * shade)


def _draw_floor_tone(dice: Dice, paints: Sequence[Tone]) -> Tone:
    if paints:
        return _shaded(dice, paints)
    skin_like, grey = dice.one(SKIN_LIKE), dice.whole(50, 150)
    dark = (dice.whole(60, 140), dice.whole(50, 100), dice.whole(40, 80))
    return dice.weighed({skin_like: 0.3, (grey, grey, grey - 6): 0.4, dark: 0.3})


def _draw_furniture(dice: Dice, right_y_m: float, left_y_m: float, rooms: Rooms) -> list[Furniture]:
    free = int((left_y_m - right_y_m - 1.0) / GAP_M)
    slots = sorted(dice.shuffled(range(free))[: dice.whole(*rooms.pieces)])
    pieces = []
    for slot, kind in zip(slots, dice.shuffled(rooms.furniture), strict=False):
        along_m = right_y_m + 0.5 + GAP_M * (slot + 0.5)
        tinted, tone = dice.chance(rooms.furniture_tinted), dice.one(SKIN_LIKE)
        pieces.append(Furniture(kind=kind, along_m=round(along_m, 2), tone=tone if tinted else None))
    return pieces
