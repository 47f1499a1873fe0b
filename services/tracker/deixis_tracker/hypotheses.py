"""Propagated pixel hypotheses (Pateraki et al. 2011, sec. 4, [1]).

Pixels of a track's last blob, moved by its Kalman state and spread by its uncertainty, are hypotheses of where its pixels
are now. Their density says how much an observed skin pixel belongs to that track, also where two objects have grown into
one blob.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float32]

CELL = 4  # pixels per cell of a density
MOST_HYPOTHESES = 256


class Cells(NamedTuple):
    """Cells (rows, columns) under pixels, in row order, and the box (top, left, bottom, right) that holds them."""

    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    box: tuple[int, int, int, int]


class Density(NamedTuple):
    """Share of hypotheses in each cell of a window whose corner is the cell (top, left); outside there are none."""

    values: NDArray[np.float32]
    top: int
    left: int

    def at(self, cells: Cells) -> NDArray[np.float32]:
        """The density in each of these cells."""
        (height, width), (top, left, bottom, right) = self.values.shape, cells.box
        rows, columns = cells.rows - self.top, cells.columns - self.left
        if top >= self.top and left >= self.left and bottom < self.top + height and right < self.left + width:
            return self.values[rows, columns]
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        found = np.zeros(len(rows), np.float32)
        found[inside] = self.values[rows[inside], columns[inside]]
        return found

    def meets(self, cells: Cells) -> bool:
        """Whether some of the cells may lie in the window."""
        (height, width), (top, left, bottom, right) = self.values.shape, cells.box
        return top < self.top + height and bottom >= self.top and left < self.left + width and right >= self.left


def sample_pixels(mask: NDArray[np.uint8], x0: int, y0: int) -> Points:
    """At most MOST_HYPOTHESES pixels (N, 2) x, y of a mask window whose corner is at (x0, y0), evenly taken."""
    places = np.flatnonzero(mask != 0)
    rows, columns = np.divmod(places[:: max(1, len(places) // MOST_HYPOTHESES)], mask.shape[1])
    return np.stack([columns + x0, rows + y0], axis=1).astype(np.float32)


def propagate(pixels: Points, dx: float, dy: float, sigma_px: float, height: int, width: int) -> Density:
    """Density of `pixels` moved by (dx, dy) and spread by `sigma_px`, per cell of CELL x CELL pixels; its sum is 1."""
    x, y = (((pixels[:, k] + np.float32(by)) / CELL).astype(np.int64) for k, by in enumerate((dx, dy)))
    last_x, last_y = width // CELL, height // CELL
    inside = (x >= 0) & (x <= last_x) & (y >= 0) & (y <= last_y)
    x, y = x[inside], y[inside]
    if not len(x):
        return Density(np.zeros((0, 0), np.float32), 0, 0)
    half = round(1.2 * min(max(0.7, sigma_px / CELL), 20.0))
    # Only as far as they spread.
    left, right = max(0, int(x.min()) - 2 * half), min(last_x, int(x.max()) + 2 * half)
    top, bottom = max(0, int(y.min()) - 2 * half), min(last_y, int(y.max()) + 2 * half)
    rows, columns = bottom - top + 1, right - left + 1
    flat = (y - top) * columns + x - left
    shares = np.bincount(flat, minlength=rows * columns).reshape(rows, columns).astype(np.float32) / max(1, len(pixels))
    # Two boxes are nearly a Gaussian, and cost the same at any width.
    side = 2 * half + 1
    once = cv2.blur(shares, (side, side), borderType=cv2.BORDER_CONSTANT)
    spread = np.asarray(cv2.blur(once, (side, side), borderType=cv2.BORDER_CONSTANT), np.float32)
    return Density(spread, top, left)


def cells_of(mask: NDArray[np.uint8], x0: int, y0: int) -> Cells:
    """Cells of a density under the set pixels of a window with its corner at (x0, y0), in row order."""
    places = cv2.findNonZero(mask)
    if places is None:
        return Cells(np.empty(0, np.int32), np.empty(0, np.int32), (0, 0, -1, -1))
    columns, rows = (np.asarray((places[:, 0, k] + corner) // CELL, np.int32) for k, corner in enumerate((x0, y0)))
    return Cells(rows, columns, (int(rows[0]), int(columns.min()), int(rows[-1]), int(columns.max())))


def support(density: Density, cells: Cells) -> float:
    """Share of a track's hypotheses that fall on the observed pixels, 0 to 1."""
    return float(min(1.0, density.at(cells).sum() / CELL**2)) if density.meets(cells) else 0.0


def best_tracks(supports: NDArray[np.float64], least: float) -> list[list[int]]:
    """Tracks (rows) that claim each blob (columns): each track the blob that holds most of its hypotheses, `least` or more.

    A track claims one blob only: one that claimed all it touches was pulled onto the other arm when its own was torn in two.
    """
    claims: list[list[int]] = [[] for _ in range(supports.shape[1])]
    for track, row in enumerate(supports):
        if len(row) and row.max() >= least:
            claims[int(np.argmax(row))].append(track)
    return claims
