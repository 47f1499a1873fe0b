"""Where in the picture a board was seen, how tilted and how near: what a lens can be told from, and what is still missing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .boards import Board
from .sightings import Sighting

ACROSS, DOWN = 8, 6
"""Cells that the picture is divided into."""
ASSUMED_FOV_DEG = 60.0
"""Until the lens is known: tilts by it are rough, and enough to tell upright boards from tilted ones."""
WANTED_SHARE = 0.7
WANTED_TILT_DEG = 25.0
EDGE_SHARE = 0.15


@dataclass(frozen=True, eq=False)
class Coverage:
    """What so many pictures show together.

    counts: corners in each cell (DOWN, ACROSS). tilt_deg: the largest angle between two boards. reach: how far corners came,
    as shares of the picture: left, right, top, bottom. nearest, farthest: share of the picture's width that boards took.
    """

    pictures: int
    counts: NDArray[np.intp]
    tilt_deg: float
    reach: tuple[float, float, float, float]
    nearest: float = 0.0
    farthest: float = 0.0

    @property
    def share(self) -> float:
        """Share of the cells in which a corner was."""
        return float(np.mean(self.counts > 0))

    @property
    def unreached(self) -> list[str]:
        """Sides of the picture that no corner came near."""
        left, right, top, bottom = self.reach
        missed = {"left": left, "right": 1 - right, "top": top, "bottom": 1 - bottom}
        return [side for side, share in missed.items() if share > EDGE_SHARE]


def cover(board: Board, sightings: Sequence[Sighting]) -> Coverage:
    """Coverage of these pictures of one size."""
    counts = np.zeros((DOWN, ACROSS), np.intp)
    if not sightings:
        return Coverage(0, counts, 0.0, (1.0, 0.0, 1.0, 0.0))
    width, height = sightings[0].size
    shares = np.concatenate([sighting.px for sighting in sightings]) / (width, height)
    cells = np.clip((shares * (ACROSS, DOWN)).astype(np.intp), 0, (ACROSS - 1, DOWN - 1))
    np.add.at(counts, (cells[:, 1], cells[:, 0]), 1)
    (left, top), (right, bottom) = shares.min(axis=0), shares.max(axis=0)
    normals = np.array([normal_of(board, sighting) for sighting in sightings])
    widths = [width_of(board, sighting) for sighting in sightings]
    reach = float(left), float(right), float(top), float(bottom)
    return Coverage(len(sightings), counts, spread_deg(normals), reach, max(widths), min(widths))


def normal_of(board: Board, sighting: Sighting) -> NDArray[np.float64]:
    """The board's normal as seen by a camera of an assumed lens: a unit vector (3)."""
    width, height = sighting.size
    focal = width / 2 / math.tan(math.radians(ASSUMED_FOV_DEG) / 2)
    matrix = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    _, turn, _ = cv2.solvePnP(sighting.corner_m(board), sighting.px, matrix, np.zeros(5), flags=cv2.SOLVEPNP_IPPE)
    return np.asarray(cv2.Rodrigues(turn)[0][:, 2], np.float64)


def width_of(board: Board, sighting: Sighting) -> float:
    """Share of the picture's width that the whole board takes, by the part in sight."""
    flat_m = np.ascontiguousarray(sighting.corner_m(board)[:, :2])
    seen_px = math.sqrt(max(1.0, cv2.contourArea(cv2.convexHull(sighting.px))))
    seen_m = math.sqrt(max(1e-9, cv2.contourArea(cv2.convexHull(flat_m))))
    return seen_px / seen_m * board.size_m[0] / sighting.size[0]


def hint(coverage: Coverage) -> str:
    """What to do next with the board, as one sentence; empty where nothing is missing."""
    if coverage.pictures == 0:
        return "Hold the board before the camera, flat, in good light."
    empty = np.argwhere(coverage.counts == 0)
    if coverage.share < WANTED_SHARE and len(empty):
        return f"Bring the board to the {_place(*_emptiest(coverage.counts))} of the picture."
    if coverage.tilt_deg < WANTED_TILT_DEG:
        return "Tilt the board: lean its top away, then a side, by 30 degrees and more."
    if coverage.unreached:
        return f"Bring the board to the {coverage.unreached[0]} edge of the picture."
    if coverage.nearest < 1.5 * coverage.farthest:
        return "Come nearer with the board, or go farther away."
    return ""


def _emptiest(counts: NDArray[np.intp]) -> tuple[int, int]:
    """Of nine parts of the picture that with the most empty cells: (0 to 2 down, 0 to 2 across)."""
    rows, columns = np.array_split(np.arange(DOWN), 3), np.array_split(np.arange(ACROSS), 3)
    empty = {(i, j): np.mean(counts[np.ix_(rows[i], columns[j])] == 0) for i in range(3) for j in range(3)}
    return max(empty, key=lambda part: empty[part])


def _place(down: int, across: int) -> str:
    """In words; in the middle both words are the same one."""
    words = [word for word in (("top", "", "bottom")[down], ("left", "", "right")[across]) if word]
    return " ".join(words) or "middle"


def spread_deg(normals: NDArray[np.float64]) -> float:
    """The largest angle between two of these unit vectors (n, 3)."""
    return float(np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1, 1))))
