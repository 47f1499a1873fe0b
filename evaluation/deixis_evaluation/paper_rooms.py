"""The three simulated environments of section 7.2, reconstructed: the paper shows them in figures 7 and 8 only.

A: one rectangular room with four POIs on its walls. B: the same with eight. C: five rooms and a corridor that joins them, with
eight POIs, of which robot and person never see more than three together. Metres; walls are segments. POIs hang on outer
walls; before an inner one they stand 0.2 m off it, so that they are seen from one side alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from deixis_fusion.visibility import Point2, Wall

Values = npt.NDArray[np.float64]
Box = tuple[float, float, float, float]

DOOR_M = 1.0


@dataclass(frozen=True)
class Room:
    """An environment: where people and robots may be (boxes x0, y0, x1, y1), its walls and its POIs."""

    name: str
    about: str
    boxes: tuple[Box, ...]
    walls: tuple[Wall, ...]
    pois: tuple[Point2, ...]

    @property
    def poi_positions(self) -> Values:
        """(n, 2), metres."""
        return np.array(self.pois, dtype=np.float64)

    @property
    def wall_ends(self) -> Values:
        """(w, 2, 2): wall, end, x and y."""
        return np.array(self.walls, dtype=np.float64)


def _around(box: Box) -> tuple[Wall, ...]:
    x0, y0, x1, y1 = box
    corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    return tuple(zip(corners, (*corners[1:], corners[0]), strict=True))


def _with_doors(x0: float, x1: float, y: float, doors: tuple[float, ...]) -> tuple[Wall, ...]:
    """A wall along x with a door about each of these places."""
    edges = [x0, *(edge for door in doors for edge in (door - DOOR_M / 2, door + DOOR_M / 2)), x1]
    return tuple(((edges[i], y), (edges[i + 1], y)) for i in range(0, len(edges), 2))


def room_a(width_m: float, depth_m: float) -> Room:
    """A rectangular room, a POI in the middle of each wall."""
    x, y = width_m, depth_m
    pois = ((x / 2, 0.0), (x, y / 2), (x / 2, y), (0.0, y / 2))
    return _hall("A", f"{x:g} x {y:g} m, a POI in the middle of each wall", x, y, pois)


def room_b(width_m: float, depth_m: float) -> Room:
    """The same with two POIs on each wall."""
    x, y = width_m, depth_m
    low_x, high_x, low_y, high_y = x / 4, x * 3 / 4, y / 4, y * 3 / 4
    lower, right = ((low_x, 0.0), (high_x, 0.0)), ((x, low_y), (x, high_y))
    upper, left = ((high_x, y), (low_x, y)), ((0.0, high_y), (0.0, low_y))
    about = f"{x:g} x {y:g} m, POIs at a quarter and three quarters of each wall"
    return _hall("B", about, x, y, (*lower, *right, *upper, *left))


def _hall(name: str, about: str, x: float, y: float, pois: tuple[Point2, ...]) -> Room:
    box = (0.0, 0.0, x, y)
    return Room(name, about, (box,), _around(box), pois)


HALL_M = (10.0, 8.0)
"""Of A and B, width and depth: chosen by table 3, `fitting/choose_paper.py`."""
ROOM_A, ROOM_B = room_a(*HALL_M), room_b(*HALL_M)
_UPPER: tuple[Box, ...] = ((0.0, 7.0, 5.0, 11.0), (5.0, 7.0, 10.0, 11.0), (10.0, 7.0, 15.0, 11.0))
_LOWER: tuple[Box, ...] = ((0.0, 0.0, 7.5, 5.0), (7.5, 0.0, 15.0, 5.0))
_CORRIDOR: Box = (0.0, 5.0, 15.0, 7.0)
ROOM_C = Room(
    "C",
    "a corridor of 15 x 2 m, three rooms of 5 x 4 m with 2, 1 and 1 POIs, two of 7.5 x 5 m with 3 and 1; doors of 1 m",
    (*_UPPER, *_LOWER, _CORRIDOR),
    (
        *_around((0.0, 0.0, 15.0, 11.0)),
        *_with_doors(0.0, 15.0, 7.0, (2.5, 7.5, 12.5)),
        *_with_doors(0.0, 15.0, 5.0, (3.75, 11.25)),
        *(((x, 7.0), (x, 11.0)) for x in (5.0, 10.0)),
        ((7.5, 0.0), (7.5, 5.0)),
    ),
    ((0.0, 8.0), (4.8, 9.0), (7.5, 11.0), (15.0, 9.0), (0.0, 2.5), (3.75, 0.0), (7.3, 2.5), (15.0, 2.5)),
)
ROOMS = (ROOM_A, ROOM_B, ROOM_C)
