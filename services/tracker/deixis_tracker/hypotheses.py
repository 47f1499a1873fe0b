"""Propagated pixel hypotheses (Pateraki et al. 2011, sec. 4, [1]).

Pixels of a track's last blob, moved by its Kalman state and spread by its uncertainty, are hypotheses of where its pixels
are now. Their density says how much an observed skin pixel belongs to that track, also where two objects have grown into
one blob.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float32]
Density = NDArray[np.float32]
Cells = tuple[NDArray[np.int64], NDArray[np.int64]]

CELL = 4  # pixels per cell of a density
MOST_HYPOTHESES = 256


def sample_pixels(mask: NDArray[np.uint8], x0: int, y0: int) -> Points:
    """At most MOST_HYPOTHESES pixels (N, 2) x, y of a mask window whose corner is at (x0, y0), evenly taken."""
    rows, columns = np.nonzero(mask)
    step = max(1, len(rows) // MOST_HYPOTHESES)
    return np.stack([columns[::step] + x0, rows[::step] + y0], axis=1).astype(np.float32)


def propagate(pixels: Points, dx: float, dy: float, sigma_px: float, height: int, width: int) -> Density:
    """Density of `pixels` moved by (dx, dy) and spread by `sigma_px`, per cell of CELL x CELL pixels; its sum is 1."""
    cells = ((pixels + np.array([dx, dy], np.float32)) / CELL).astype(np.int64)
    rows, columns = height // CELL + 1, width // CELL + 1
    inside = (cells[:, 0] >= 0) & (cells[:, 0] < columns) & (cells[:, 1] >= 0) & (cells[:, 1] < rows)
    flat = cells[inside, 1] * columns + cells[inside, 0]
    density = np.bincount(flat, minlength=rows * columns).reshape(rows, columns).astype(np.float32) / max(1, len(pixels))
    side = (
        2 * round(1.2 * min(max(0.7, sigma_px / CELL), 20.0)) + 1
    )  # two boxes are nearly a Gaussian, and cost the same at any width
    once = cv2.blur(density, (side, side), borderType=cv2.BORDER_CONSTANT)
    return np.asarray(cv2.blur(once, (side, side), borderType=cv2.BORDER_CONSTANT), np.float32)


def cells_of(mask: NDArray[np.uint8], x0: int, y0: int) -> Cells:
    """Cells (rows, columns) of a density under the set pixels of a window with its corner at (x0, y0), in row order."""
    rows, columns = np.nonzero(mask)
    return (rows + y0) // CELL, (columns + x0) // CELL


def support(density: Density, cells: Cells) -> float:
    """Share of a track's hypotheses that fall on the observed pixels, 0 to 1."""
    return float(min(1.0, density[cells].sum() / CELL**2))


def best_tracks(supports: NDArray[np.float64], least: float) -> list[list[int]]:
    """Tracks (rows) that claim each blob (columns): each track the blob that holds most of its hypotheses, `least` or more.

    A track claims one blob only: one that claimed all it touches was pulled onto the other arm when its own was torn in two.
    """
    claims: list[list[int]] = [[] for _ in range(supports.shape[1])]
    for track, row in enumerate(supports):
        if len(row) and row.max() >= least:
            claims[int(np.argmax(row))].append(track)
    return claims
