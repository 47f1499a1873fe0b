"""Finder of heads and hands by their shape, whatever their colour: from the front, in profile, from behind, of grey cameras.

A small network of convolutions (`finder.onnx`, 1 MB) answers with maps, a cell for STRIDE x STRIDE pixels: log odds that the
middle of a head, of somebody's right hand or of the left one is there, and how wide that head is. It knows heads about
6.5 to 30 pixels wide, so a picture is searched at several sizes, and the surroundings of a known head are scaled to the one
that it knows best. It was fitted on the simulator's fitting people alone (`fitting/fit_finder.py`).

OpenCV's `dnn` runs it: it comes with the OpenCV that the tracker needs anyway, and its convolutions are quicker than numpy's.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from importlib.resources import files
from typing import NamedTuple

import cv2
import numpy as np
from deixis_schemas.anatomy import HEAD_WIDTH_M
from numpy.typing import NDArray

from deixis_tracker.camera_motion import Shift
from deixis_tracker.frame import Box, Image

Maps = NDArray[np.float32]

STRIDE, GRAIN = 4, 16  # pixels of a cell; what the sides of its pictures are multiples of
USUAL_PX = 14.0  # width of a head in the surroundings of a known one
PIXEL_MIDDLE, PIXEL_SPREAD = 115.0, 60.0
WIDTH_PER_BREADTH = HEAD_WIDTH_M / 0.185  # width of a head, by its breadth ear to ear, which the network was fitted to
KNOWN_PX = (6.5, 30.0)  # breadths of heads that it knows
HEAD, RIGHT_HAND, LEFT_HAND, BREADTH = range(4)
HAND = 4  # made of the two maps of hands: of whichever side
SEARCHED_PX, SHARED_PX = 320, 64  # longest side of what is searched at once, and how far parts of a picture overlap
LEAST_SHRUNK = 1.5  # pixels of the frame that are made one, at least: noise fills what is finer
LEAST_SIDE_PX = 48  # a smaller picture shows no head with what is around it
WIDE, ABOVE, BELOW = 5.3, 3.2, 6.2  # surroundings of a head that are looked at, head widths; an arm is about 4.5 long
NEIGHBOURS = np.ones((3, 3), np.uint8)
NEAREST = 0.6  # two heads of one picture are so many widths apart, at least


class Seen(NamedTuple):
    """A place (x, y) in pixels of the picture, and the log odds of the thing being there; of heads: their width, pixels."""

    x: float
    y: float
    odds: float
    width: float = 0.0


class Surroundings:
    """Maps of what is around a head; places and lengths of the picture they were made from."""

    def __init__(self, maps: Maps, x0: float, y0: float, scale: float) -> None:
        """`maps` (4, h, w) of a part of the picture whose corner is at (x0, y0), `scale` of its pixels to one of theirs."""
        # Of an arm held across the body the network doubts whose hand it is, not that it is one: it shares out the odds.
        self._maps = np.concatenate([maps, np.logaddexp(maps[RIGHT_HAND], maps[LEFT_HAND])[None]])
        self._x0, self._y0, self._scale = x0, y0, scale
        self._summits: dict[int, tuple[list[float], list[tuple[int, int]]]] = {}
        self._seen: dict[tuple[int, int, int], Seen] = {}

    def moved(self, shift: Shift) -> Surroundings:
        """The same maps where the room has moved."""
        height, width = (0.5 * STRIDE * self._scale * side for side in self._maps.shape[1:])
        x, y = shift.moved(self._x0 + width, self._y0 + height)
        return Surroundings(self._maps[:HAND], x - width, y - height, self._scale)

    def heads(self, least: float) -> list[Seen]:
        """Heads of so high log odds, best first."""
        return self._peaks(HEAD, least)

    def hands(self, kind: int, least: float) -> list[Seen]:
        """Right or left hands, or of either side (HAND), of so high log odds, best first."""
        return self._peaks(kind, least)

    def odds_near(self, kind: int, x: float, y: float, reach: float) -> float:
        """The highest log odds within `reach` pixels of a place; -inf outside."""
        column, row = self._cell(x, y)
        half = max(1.0, reach / (STRIDE * self._scale))
        rows = slice(max(0, round(row - half)), max(0, round(row + half) + 1))
        columns = slice(max(0, round(column - half)), max(0, round(column + half) + 1))
        part = self._maps[kind, rows, columns]
        return float(part.max()) if part.size else -np.inf

    def _cell(self, x: float, y: float) -> tuple[float, float]:
        middle = (STRIDE - 1) / 2
        return tuple((((at - of + 0.5) / self._scale - 0.5) - middle) / STRIDE for at, of in ((x, self._x0), (y, self._y0)))  # type: ignore[return-value]

    def _peaks(self, kind: int, least: float) -> list[Seen]:
        # Each is worked out once, for these are asked for again and again: for each blob, and until the next look.
        if kind not in self._summits:
            self._summits[kind] = _summits(self._maps[kind])
        heights, cells = self._summits[kind]
        return [self._peak(kind, *cell) for cell in cells[: bisect_right(heights, -least)]]

    def _peak(self, kind: int, row: int, column: int) -> Seen:
        at = kind, row, column
        if at not in self._seen:
            self._seen[at] = self._worked_out(kind, row, column)
        return self._seen[at]

    def _worked_out(self, kind: int, row: int, column: int) -> Seen:
        odds = self._maps[kind]
        dx, dy = _summit(odds[row], column), _summit(odds[:, column], row)
        middle = (STRIDE - 1) / 2
        x, y = (((at * STRIDE + middle + 0.5) * self._scale - 0.5) for at in (column + dx, row + dy))
        width = 0.0
        if kind == HEAD:
            breadth = USUAL_PX * float(np.exp(np.clip(self._maps[BREADTH, row, column], -1.5, 1.5)))
            width = breadth * self._scale * WIDTH_PER_BREADTH
        return Seen(self._x0 + x, self._y0 + y, float(odds[row, column]), width)


class Finder:
    """The network. Raises RuntimeError where this build of OpenCV cannot run it."""

    def __init__(self) -> None:
        weights = np.frombuffer(files("deixis_tracker").joinpath("finder.onnx").read_bytes(), np.uint8)
        try:
            self._network = cv2.dnn.readNetFromONNX(weights)
        except cv2.error as error:
            raise RuntimeError(f"finder.onnx: OpenCV {cv2.__version__} cannot read it ({error})") from None

    def maps(self, picture: Image) -> Maps:
        """Maps (4, h / STRIDE, w / STRIDE) of a picture (h, w, 3) BGR; its sides are multiples of GRAIN."""
        blob = cv2.dnn.blobFromImage(picture, 1 / PIXEL_SPREAD, mean=(PIXEL_MIDDLE,) * 3)
        self._network.setInput(blob)
        return np.asarray(self._network.forward()[0], np.float32)

    def around(self, picture: Image, x: float, y: float, width: float) -> Surroundings:
        """What is around the head at (x, y) of a picture (h, w, 3) BGR; `width`: of the head, pixels."""
        scale = width / (USUAL_PX * WIDTH_PER_BREADTH)
        left, top, right, bottom = x - WIDE * width, y - ABOVE * width, x + WIDE * width, y + BELOW * width
        # A head may be predicted far outside; a part without a pixel would end the stage.
        x0, y0 = min(max(0, int(left)), picture.shape[1] - 1), min(max(0, int(top)), picture.shape[0] - 1)
        part = picture[y0 : max(y0 + 1, min(picture.shape[0], round(bottom))), x0 : max(x0 + 1, round(right))]
        return self._looked_at(part, x0, y0, scale)

    def over(self, picture: Image, look: Look) -> Surroundings:
        """What is in a part of a picture, or in all of it."""
        rows, columns = look.part.window(*picture.shape[:2])
        return self._looked_at(picture[rows, columns], columns.start, rows.start, look.scale)

    def _looked_at(self, part: Image, x0: int, y0: int, scale: float) -> Surroundings:
        size = max(1, round(part.shape[1] / scale)), max(1, round(part.shape[0] / scale))
        small = cv2.resize(part, size, interpolation=cv2.INTER_AREA if scale > 1 else cv2.INTER_LINEAR)
        right, below = -size[0] % GRAIN, -size[1] % GRAIN
        padded = cv2.copyMakeBorder(small, 0, below, 0, right, cv2.BORDER_REPLICATE)
        maps = self.maps(np.asarray(padded, np.uint8))
        return Surroundings(maps[:, : -(-size[1] // STRIDE), : -(-size[0] // STRIDE)], x0, y0, scale)


class Look(NamedTuple):
    """A part of a picture that is searched; `scale` of its pixels are made one."""

    part: Box
    scale: float


def whole_looks(height: int, width: int) -> list[Look]:
    """Looks at a whole picture of that size, the finest first; two are an octave apart."""
    whole = Box(0, 0, width, height)
    looks = [Look(whole, max(1.0, max(height, width) / SEARCHED_PX))]
    while min(height, width) / (2 * looks[-1].scale) >= LEAST_SIDE_PX:
        looks.append(Look(whole, 2 * looks[-1].scale))
    return looks


def close_looks(height: int, width: int, frame_scale: float, least_px: float) -> list[Look]:
    """Looks at parts of a picture in which heads of `least_px` or more show that are too small for the whole ones.

    `frame_scale` pixels of the frame are one of the picture's; what the frame itself hardly shows is not looked for. No part
    costs more than a whole look.
    """
    looks: list[Look] = []
    scale = whole_looks(height, width)[0].scale
    while KNOWN_PX[0] * WIDTH_PER_BREADTH * scale > least_px and scale / 2 >= max(1.0, LEAST_SHRUNK / frame_scale):
        scale /= 2
        ends = [_parts(side, scale * SEARCHED_PX, scale * SHARED_PX) for side in (width, height)]
        looks += [Look(Box(x, y, w, h), scale) for y, h in ends[1] for x, w in ends[0]]
    return looks


def _parts(side: int, most: float, shared: float) -> list[tuple[float, float]]:
    """Start and length of parts of a side that overlap by `shared` and are not longer than `most`, all of one length."""
    count = max(1, math.ceil((side - shared) / (most - shared)))
    length = (side + (count - 1) * shared) / count
    return [(k * (length - shared), length) for k in range(count)]


def apart(heads: list[Seen]) -> list[Seen]:
    """Of heads that lie on one another the best, best first."""
    kept: list[Seen] = []
    for seen in sorted(heads, key=lambda head: -head.odds):
        near = (np.hypot(seen.x - other.x, seen.y - other.y) < NEAREST * max(seen.width, other.width) for other in kept)
        if not any(near):
            kept.append(seen)
    return kept


def _summits(odds: Maps) -> tuple[list[float], list[tuple[int, int]]]:
    """Odds, their sign turned, and cells (row, column) of a map's local maxima, the highest first."""
    rows, columns = np.nonzero(odds >= cv2.dilate(odds, NEIGHBOURS))
    turned = -odds[rows, columns]
    order = np.argsort(turned, kind="stable")
    cells = list(zip(rows[order].tolist(), columns[order].tolist(), strict=True))
    return turned[order].tolist(), cells


def _summit(line: Maps, k: int) -> float:
    """Offset of the summit of the parabola through three points around `k`."""
    if not 0 < k < len(line) - 1:
        return 0.0
    left, middle, right = (float(value) for value in line[k - 1 : k + 2])
    bend = left - 2 * middle + right
    return 0.0 if bend >= 0 else max(-0.5, min(0.5, 0.5 * (left - right) / bend))
