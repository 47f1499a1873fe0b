"""The corners of a board in one picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .boards import FEWEST_CORNERS, Board

Image = NDArray[np.uint8]
Points = NDArray[np.float32]
FINDER_FLAGS = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY


@dataclass(frozen=True, eq=False)
class Sighting:
    """A board in a picture: `ids` (n) of its corners, as `Board.corner_m` counts them, and where they are, `px` (n, 2)."""

    name: str
    size: tuple[int, int]
    ids: NDArray[np.intp]
    px: Points

    def corner_m(self, board: Board) -> Points:
        """The corners in sight (n, 3) on the board."""
        return board.corner_m[self.ids]


def finder_of(board: Board) -> Callable[[str, Image], Sighting | None]:
    """What finds this board in pictures: (name, (h, w) or (h, w, 3) picture) -> its corners; none where it is not seen."""
    if board.pattern == "chessboard":
        return lambda name, image: _chessboard(board, name, _grey(image))
    detector = cv2.aruco.CharucoDetector(board.charuco)
    return lambda name, image: _charuco(detector, name, _grey(image))


def _chessboard(board: Board, name: str, grey: Image) -> Sighting | None:
    found, corners = cv2.findChessboardCornersSB(grey, board.inner, flags=FINDER_FLAGS)
    if not found:
        return None
    return Sighting(name, _size(grey), np.arange(board.corners), np.asarray(corners, np.float32).reshape(-1, 2))


def _charuco(detector: cv2.aruco.CharucoDetector, name: str, grey: Image) -> Sighting | None:
    corners, ids, _, _ = detector.detectBoard(grey)
    if ids is None or len(ids) < FEWEST_CORNERS:
        return None
    px = np.asarray(corners, np.float32).reshape(-1, 2)
    return Sighting(name, _size(grey), np.asarray(ids, np.intp).ravel(), px) if _is_wide(px) else None


def _is_wide(px: Points) -> bool:
    """Whether corners span a plane: those of one row fix no view of it."""
    spread = np.linalg.svd(px - px.mean(axis=0), compute_uv=False)
    return bool(spread[1] > 0.05 * spread[0])


def _grey(image: Image) -> Image:
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


def _size(grey: Image) -> tuple[int, int]:
    return grey.shape[1], grey.shape[0]
