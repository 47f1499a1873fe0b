"""From figures to what the finder is fitted on: windows of pictures as a tracker has them, and maps of what is where.

A window is tiled with figures, so that people stand at its edges, behind each other and at every size; then a camera's faults
are put on it (`fit_crops.taken`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from deixis_tracker.finder import STRIDE, USUAL_PX
from figure_files import AREAS, BREADTH, HANDS, HEAD, SEEN, Figures
from fit_crops import taken
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
WINDOW_PX = 128
CELLS = WINDOW_PX // STRIDE
HEADS_PX, NEAR_USUAL, NEAR_USUAL_SPREAD = (6.5, 30.0), 0.5, 0.25
"""Breadths of heads in windows; the share of windows whose head is about as wide as the tracker scales it to."""
KNOWN_PX = (5.5, 36.0)
"""Heads of other breadths are not asked for."""
SCALES = (0.25, 1.6)
"""Of figures, at least and at most."""
SEEN_HEAD, HIDDEN_HEAD = 0.35, 0.08
SEEN_HAND, HIDDEN_HAND = 0.07, 0.012
"""Head: shares that are seen; hand: areas seen, in breadths squared. From the first on it is to be found, below the second
not; between them either answer is right."""
HEAD_SIGMA, HAND_SIGMA, LEAST_SIGMA = 0.25, 0.22, 0.8
"""How wide a thing is in its map: breadths, and cells."""
MIRRORED, EMPTY, EMPTY_TILES = 0.5, 0.12, 0.25
"""Shares of windows that are mirrored, and that show a room without people; of other tiles that do."""


@dataclass(frozen=True)
class Windows:
    """A batch. pixels: (n, WINDOW_PX, WINDOW_PX, 3). maps: (n, 3, CELLS, CELLS) of heads, right and left hands, 0 to 1, and
    weights of the same shape, 0 where nothing is asked. sizes: (n, CELLS, CELLS), log(breadth / USUAL_PX), not a number where
    no head is.
    """

    pixels: NDArray[np.uint8]
    maps: Floats
    weights: Floats
    sizes: Floats


def windows_of(figures: Figures, count: int, rng: np.random.Generator) -> Windows:
    """So many windows of these figures."""
    made = [_window(figures, rng) for _ in range(count)]
    return Windows(*(np.array(values) for values in zip(*made, strict=True)))


def _window(figures: Figures, rng: np.random.Generator) -> tuple[Any, ...]:
    pixels, maps = _empty(figures, rng) if rng.random() < EMPTY else _tiled(figures, rng)
    pixels = taken(pixels, rng)
    if rng.random() < MIRRORED:
        return pixels[:, ::-1], maps.maps[[0, 2, 1], :, ::-1], maps.weights[[0, 2, 1], :, ::-1], maps.sizes[:, ::-1]
    return pixels, maps.maps, maps.weights, maps.sizes


def _empty(figures: Figures, rng: np.random.Generator) -> tuple[NDArray[np.uint8], _Maps]:
    """A part of a room without people, as coarse as the search sees rooms, or coarser."""
    room = figures.rooms[int(rng.integers(len(figures.rooms)))]
    height, width = room.shape[:2]
    side = int(rng.integers(WINDOW_PX * 3 // 4, height + 1))
    top, left = int(rng.integers(0, height - side + 1)), int(rng.integers(0, width - side + 1))
    part = room[top : top + side, left : left + side]
    return np.asarray(cv2.resize(part, (WINDOW_PX, WINDOW_PX), interpolation=cv2.INTER_AREA), np.uint8), _Maps()


def _tiled(figures: Figures, rng: np.random.Generator) -> tuple[NDArray[np.uint8], _Maps]:
    first = int(rng.integers(len(figures)))
    scale, corner = _placed(figures.people[first, 0], rng)
    side = figures.pictures.shape[1] * scale
    pixels = np.zeros((WINDOW_PX, WINDOW_PX, 3), np.uint8)
    maps = _Maps()
    columns, rows = (range(int(np.floor(-at / side)), int(np.ceil((WINDOW_PX - at) / side))) for at in corner)
    for row in rows:
        for column in columns:
            at = corner + side * np.array([column, row])
            middle = row == column == 0
            if not middle and rng.random() < EMPTY_TILES:
                _paste(pixels, _room_tile(figures, rng), at, side)
                continue
            number = first if middle else int(rng.integers(len(figures)))
            _paste(pixels, figures.pictures[number], at, side)
            for person in figures.people[number]:
                maps.add(_moved(person, scale, at), at, side)
    return pixels, maps


def _room_tile(figures: Figures, rng: np.random.Generator) -> NDArray[np.uint8]:
    room = figures.rooms[int(rng.integers(len(figures.rooms)))]
    left = int(rng.integers(0, room.shape[1] - room.shape[0] + 1))
    return np.asarray(room[:, left : left + room.shape[0]], np.uint8)


def _placed(person: Floats, rng: np.random.Generator) -> tuple[float, Floats]:
    """Scale of the first figure, and where its corner is in the window, so that its head is somewhere in it."""
    near_usual = rng.random() < NEAR_USUAL
    wanted = USUAL_PX * np.exp(rng.normal(0, NEAR_USUAL_SPREAD)) if near_usual else np.exp(rng.uniform(*np.log(HEADS_PX)))
    scale = float(np.clip(wanted / person[BREADTH], *SCALES))
    return scale, WINDOW_PX * rng.uniform([0.05, 0.05], [0.95, 0.8]) - scale * person[HEAD]


def _moved(person: Floats, scale: float, at: Floats) -> Floats:
    """A person's columns, in pixels of the window."""
    moved = person.astype(float)
    moved[BREADTH] *= scale
    moved[HEAD] = moved[HEAD] * scale + at
    moved[HANDS] = moved[HANDS] * scale + np.tile(at, 2)
    moved[AREAS] = moved[AREAS] * scale**2
    return moved


def _paste(pixels: NDArray[np.uint8], picture: NDArray[np.uint8], at: Floats, side: float) -> None:
    # Not blurred and warped in one: that cost three quarters of a window's time, and windows half of the training's.
    rough = max(1, round(side))
    if rough < picture.shape[0]:
        picture = np.asarray(cv2.resize(picture, (rough, rough), interpolation=cv2.INTER_AREA), np.uint8)
    scale = side / picture.shape[0]
    left, top = (max(0, round(value)) for value in at)
    right, bottom = (min(WINDOW_PX, round(value + side)) for value in at)
    if right <= left or bottom <= top:
        return
    x0, y0 = at - (left, top)
    warp = np.array([[scale, 0, x0 + 0.5 * scale - 0.5], [0, scale, y0 + 0.5 * scale - 0.5]])
    size = right - left, bottom - top
    pixels[top:bottom, left:right] = cv2.warpAffine(
        picture, warp, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )


class _Maps:
    """The maps of one window, person by person."""

    def __init__(self) -> None:
        self.maps = np.zeros((3, CELLS, CELLS), np.float32)
        self.weights = np.ones((3, CELLS, CELLS), np.float32)
        self.sizes = np.full((CELLS, CELLS), np.nan, np.float32)
        self._y, self._x = np.mgrid[:CELLS, :CELLS] * float(STRIDE) + (STRIDE - 1) / 2

    def add(self, person: Floats, at: Floats, side: float) -> None:
        """Add a person of the figure whose corner is at `at`."""
        breadth, seen = person[BREADTH], person[SEEN]
        if not np.isfinite(breadth) or seen <= 0:
            return
        asked = KNOWN_PX[0] <= breadth <= KNOWN_PX[1]
        inside = bool(np.all((person[HEAD] > at) & (person[HEAD] < at + side)))
        self._draw(0, person[HEAD], breadth, HEAD_SIGMA, self._judged(seen, SEEN_HEAD, HIDDEN_HEAD, asked and inside))
        if asked and inside and seen >= SEEN_HEAD:
            near = np.hypot(self._x - person[HEAD][0], self._y - person[HEAD][1]) < max(1.6 * STRIDE, 0.3 * breadth)
            self.sizes[near] = np.log(breadth / USUAL_PX)
        for number in range(2):
            area = person[AREAS][number] / breadth**2
            place = person[HANDS][2 * number : 2 * number + 2]
            self._draw(1 + number, place, breadth, HAND_SIGMA, self._judged(area, SEEN_HAND, HIDDEN_HAND, asked))

    @staticmethod
    def _judged(seen: float, enough: float, little: float, asked: bool) -> bool | None:
        """Whether a thing is to be found; none where either answer is right."""
        if seen < little:
            return False
        return True if asked and seen >= enough else None

    def _draw(self, channel: int, place: Floats, breadth: float, sigma: float, found: bool | None) -> None:
        if found is False:
            return
        away = np.hypot(self._x - place[0], self._y - place[1])
        if found is None:
            self.weights[channel][away < max(0.7 * breadth, 1.5 * STRIDE)] = 0
            return
        wide = max(sigma * breadth, LEAST_SIGMA * STRIDE)
        self.maps[channel] = np.maximum(self.maps[channel], np.exp(-0.5 * (away / wide) ** 2))
