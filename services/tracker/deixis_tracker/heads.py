"""Heads whose face is not to be seen from the front, followed through turns by their colours and outline.

A head is hair and skin in front of something else. From the picture in which its face was found, the colours inside the
head's ellipse and around it are learned; in each frame an ellipse with a bright inside and a dark outside (above and beside
the head; below are neck and shirt) is laid over the map of P(head | colour), and the best place near the prediction is the
head. Profile and back of the head keep colour and outline, so the centre stays that of the head through any turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.frame import Image, around
from deixis_tracker.skin import colour_table, look_up, smoothed

Map = NDArray[np.float32]

# The head is W = anatomy.HEAD_WIDTH_M wide and 1.36 W high.
HALF_WIDTH, HALF_HEIGHT = 0.5, 0.68
CELLS_PER_WIDTH = 16
SEARCH = 0.55  # head widths around the prediction
BINS = 16
LEAST_SUPPORT = 0.12


@dataclass
class HeadFound:
    """Head centre in pixels, and how well the ellipse stands out there: mean inside less mean around, -1 to 1."""

    x: float
    y: float
    support: float


def _grid(half_cells: int, cells_per_width: float) -> tuple[Map, Map]:
    axis = np.arange(-half_cells, half_cells + 1, dtype=np.float32) / cells_per_width
    x, y = np.meshgrid(axis, axis)
    return np.asarray(x, np.float32), np.asarray(y, np.float32)


def ellipse_kernels() -> tuple[Map, Map]:
    """(inside, around) kernels at CELLS_PER_WIDTH cells per head width, each summing to 1."""
    x, y = _grid(CELLS_PER_WIDTH, CELLS_PER_WIDTH)
    radius = np.hypot(x / HALF_WIDTH, y / HALF_HEIGHT)
    inside: Map = np.clip((1.06 - radius) / 0.12, 0, 1).astype(np.float32)
    ring = ((radius > 1.08) & (radius < 1.5) & (y < 0.25)).astype(np.float32)
    return np.asarray(inside / inside.sum(), np.float32), np.asarray(ring / ring.sum(), np.float32)


class HeadColours:
    """P(head | colour) of one head, from the colours inside and around it."""

    def __init__(self) -> None:
        self._inside: Map | None = None
        self._around: Map | None = None
        self._table = _share_table(np.full((BINS,) * 3, 127, np.uint8))

    def learn(self, image: Image, x: float, y: float, width: float, rate: float) -> None:
        """Move the model by `rate` toward the picture around a head at (x, y)."""
        rows, columns = around(x, y, width, width, width, width).window(*image.shape[:2])
        part = image[rows, columns]
        if part.size == 0:
            return
        gx = (np.arange(columns.start, columns.stop) - x) / width
        gy = (np.arange(rows.start, rows.stop) - y) / width
        radius = np.hypot(gx[None] / HALF_WIDTH, gy[:, None] / HALF_HEIGHT)
        inside = np.asarray(radius < 0.92, np.uint8)
        ring = np.asarray((radius > 1.12) & (radius < 1.7) & (gy[:, None] < 0.3), np.uint8)
        self._inside = _blend(self._inside, _histogram(part, inside), rate)
        self._around = _blend(self._around, _histogram(part, ring), rate)
        share = 255 * self._inside / np.maximum(self._inside + self._around, 1e-9)
        self._table = _share_table(share.astype(np.uint8))

    def map(self, part: Image) -> Map:
        """P(head) of each pixel, 0 to 1."""
        return look_up(self._table, part)


def _share_table(of_255: Image) -> Map:
    return colour_table(np.asarray(of_255 * np.float32(1 / 255), np.float32))


def _histogram(part: Image, mask: Image) -> Map:
    """Share of each colour, smoothed over neighbouring bins."""
    counts = smoothed(cv2.calcHist([part], [0, 1, 2], mask, [BINS] * 3, [0, 256] * 3).astype(np.float64), 0.2)
    return np.asarray((counts + 1e-3) / (counts.sum() + 1e-3 * BINS**3), np.float32)


def _blend(old: Map | None, new: Map, rate: float) -> Map:
    return new if old is None else np.asarray(old + np.float32(rate) * (new - old), np.float32)


class HeadFinder:
    """Lays the ellipse over the map of P(head)."""

    def __init__(self) -> None:
        inside, around = ellipse_kernels()
        self._kernel = inside - around
        self._offsets = _grid(round((1 + SEARCH) * CELLS_PER_WIDTH) - CELLS_PER_WIDTH, CELLS_PER_WIDTH)
        self._away = self._offsets[0] ** 2 + self._offsets[1] ** 2

    def find(self, image: Image, colours: HeadColours, x: float, y: float, width: float, tightness: float) -> HeadFound:
        """The head near the prediction (x, y). `tightness`: penalty on leaving it by one head width, in units of support."""
        reach = 1 + SEARCH
        scale = CELLS_PER_WIDTH / width
        side = round(2 * reach * CELLS_PER_WIDTH) + 1
        # One affine warp cuts, scales and pads; out of the picture counts as undecided.
        matrix = np.array([[scale, 0, (side - 1) / 2 - x * scale], [0, scale, (side - 1) / 2 - y * scale]])
        box = around(x, y, reach * width, reach * width, reach * width, reach * width)
        rows, columns = box.window(*image.shape[:2])
        part = image[rows, columns]
        if part.size == 0:
            return HeadFound(x, y, -1.0)
        if scale < 1:
            part = np.asarray(cv2.blur(part, (max(1, round(0.7 / scale)),) * 2), np.uint8)
        matrix[:, 2] += scale * np.array([columns.start, rows.start])
        small = cv2.warpAffine(colours.map(part), matrix, (side, side), flags=cv2.INTER_LINEAR, borderValue=0.5)
        contrast = np.asarray(cv2.matchTemplate(small, self._kernel, cv2.TM_CCORR), np.float32)
        gx, gy = self._offsets
        score = contrast - np.float32(tightness) * self._away
        row, column = np.unravel_index(int(np.argmax(score)), score.shape)
        dx = float(gx[row, column]) + _parabola(score[row], int(column)) / CELLS_PER_WIDTH
        dy = float(gy[row, column]) + _parabola(score[:, column], int(row)) / CELLS_PER_WIDTH
        return HeadFound(x + dx * width, y + dy * width, float(contrast[row, column]))


def _parabola(line: Map, k: int) -> float:
    """Offset of the summit of the parabola through three points around `k`."""
    if not 0 < k < len(line) - 1:
        return 0.0
    left, middle, right = (float(v) for v in line[k - 1 : k + 2])
    bend = left - 2 * middle + right
    return 0.0 if bend >= 0 else max(-0.5, min(0.5, 0.5 * (left - right) / bend))
