"""Boards that a lens is measured with: chessboards, and ChArUco boards, of which a part in sight is enough."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

Pattern = Literal["charuco", "chessboard"]
DICTIONARIES = {
    name: getattr(cv2.aruco, name)
    for name in ("DICT_4X4_50", "DICT_4X4_250", "DICT_5X5_100", "DICT_5X5_250", "DICT_6X6_250", "DICT_6X6_1000")
}
FEWEST_CORNERS = 8
"""Of a picture: a homography has eight unknowns, and of fewer corners a wrong one cannot be told."""
LARGEST_SIDE = 40


class BoardError(ValueError):
    """A board that cannot be; the text says why."""


@dataclass(frozen=True)
class Board:
    """A board: `columns` x `rows` squares of `square_m` metres; markers of a ChArUco board have sides of `marker_m`."""

    pattern: Pattern
    columns: int
    rows: int
    square_m: float
    marker_m: float = 0.0
    dictionary: str = "DICT_4X4_50"

    def __post_init__(self) -> None:
        """Raises BoardError."""
        if not (3 <= self.columns <= LARGEST_SIDE and 3 <= self.rows <= LARGEST_SIDE):
            raise BoardError(f"{self.columns} x {self.rows} squares: a board has 3 to {LARGEST_SIDE} a side")
        if not 0.001 <= self.square_m <= 2:
            raise BoardError(f"squares of {self.square_m:g} m: 0.001 to 2 can be")
        if self.pattern == "chessboard":
            return
        if not 0.3 * self.square_m <= self.marker_m < self.square_m:
            raise BoardError(f"markers of {self.marker_m:g} m in squares of {self.square_m:g} m: 30 to 99 % of a square can be")
        if self.dictionary not in DICTIONARIES:
            raise BoardError(f"dictionary '{self.dictionary}' is none of {', '.join(DICTIONARIES)}")
        needed, held = self.columns * self.rows // 2, len(self._dictionary.bytesList)
        if needed > held:
            raise BoardError(f"{self.columns} x {self.rows} squares take {needed} markers, {self.dictionary} has {held}")

    @property
    def inner(self) -> tuple[int, int]:
        """Corners between squares: along a row, and rows of them."""
        return self.columns - 1, self.rows - 1

    @property
    def corners(self) -> int:
        """How many corners a picture of the whole board shows."""
        return self.inner[0] * self.inner[1]

    @cached_property
    def corner_m(self) -> NDArray[np.float32]:
        """Corners (n, 3) on the board, row by row, metres from the first; the board is the plane z = 0."""
        across, down = self.inner
        grid = np.zeros((across * down, 3), np.float32)
        grid[:, :2] = np.mgrid[0:across, 0:down].T.reshape(-1, 2) * self.square_m
        return grid

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of the squares together."""
        return self.columns * self.square_m, self.rows * self.square_m

    def draw(self, square_px: int) -> NDArray[np.uint8]:
        """The squares as a grey picture, `square_px` each, without a margin."""
        if self.pattern == "charuco":
            size = self.columns * square_px, self.rows * square_px
            return np.asarray(self.charuco.generateImage(size, marginSize=0, borderBits=1), np.uint8)
        dark = np.add.outer(np.arange(self.rows), np.arange(self.columns)) % 2 == 0
        squares = np.where(dark, 0, 255).astype(np.uint8)
        return np.asarray(squares.repeat(square_px, axis=0).repeat(square_px, axis=1), np.uint8)

    @cached_property
    def charuco(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's board of the same squares and markers."""
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, self._dictionary)

    @property
    def _dictionary(self) -> cv2.aruco.Dictionary:
        return cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary])

    def __str__(self) -> str:
        """As it is named to people."""
        squares = f"{self.columns} x {self.rows} squares of {1000 * self.square_m:g} mm"
        if self.pattern == "chessboard":
            return f"chessboard, {squares} ({self.inner[0]} x {self.inner[1]} inner corners)"
        return f"ChArUco board, {squares}, markers of {1000 * self.marker_m:g} mm from {self.dictionary}"
