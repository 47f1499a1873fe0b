"""How the camera itself moves: a robot turns its head, drives, or is pushed, and then the whole room moves in the picture.

Corners of the room (none on people) are followed from frame to frame by optical flow (Lucas and Kanade), and a shift, turn and
scale is fitted that most of them agree on. Nothing is followed while the picture stands still, which costs one comparison.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.frame import COARSE, Image, Mask, Step

Matrix = NDArray[np.float64]

SHRUNK = 0.5  # of the coarse picture
STIRRED_LEVELS, STIRRED = 9, 0.012  # grey levels of a pixel, and the share of the room that differs by so much when it moves
CORNERS, QUALITY, APART_PX = 70, 0.02, 5
FLOW_WINDOW, FLOW_LEVELS = (11, 11), 2
AGREE_PX, LEAST_CORNERS, LEAST_SHARE = 0.4, 10, 0.55  # of the shrunk picture; how many corners follow one motion
LEAST_PX = 0.12  # a motion of less is none
COMPARED_S = 0.5  # the longest between two pictures that are compared
MOVES_FOR_S = 0.6  # so long after the last motion the camera counts as moving


@dataclass(frozen=True)
class Shift:
    """How points of the room went from the last picture to this, in pixels of the working picture; the same for all sizes."""

    matrix: Matrix

    @classmethod
    def none(cls) -> Shift:
        """The camera stands."""
        return cls(np.eye(2, 3))

    @property
    def is_none(self) -> bool:
        """Whether it is that."""
        return bool(np.array_equal(self.matrix, np.eye(2, 3)))

    def moved(self, x: float, y: float) -> tuple[float, float]:
        """Where a point of the last picture is now."""
        x, y = (float(value) for value in self.matrix @ (x, y, 1.0))
        return x, y

    def of_size(self, scale: float) -> Matrix:
        """The matrix for pictures of so many times the working picture's size."""
        matrix = self.matrix.copy()
        # Middles of pixels are at whole numbers, so the corner of a picture is half a pixel off its origin.
        middle = 0.5 * (1 / scale - 1)
        matrix[:, 2] = scale * (matrix[:, 2] + matrix[:, :2] @ (middle, middle) - middle)
        return matrix


class CameraMotion:
    """Compares each picture with an earlier one, so that slow motion adds up until it can be measured."""

    def __init__(self, coarse: Image) -> None:
        """Start from a first coarse picture (H, W, 3)."""
        self._earlier = self._shrunk(coarse)
        self._earlier_ns = 0
        self._moved_ns = -(10**18)
        self.moves = False
        self.offset = (0.0, 0.0)  # of the room in the middle of the picture, since the start, pixels of the working picture

    def update(self, coarse: Image, people: Mask, step: Step) -> Shift:
        """How the room moved since the last picture; `people`: 255 where they were, of the coarse picture's size."""
        now = self._shrunk(coarse)
        room = self._room(people, now)
        stirred = self._is_stirred(self._earlier, now, room)
        shift = self._fitted(self._earlier, now, room) if stirred else None
        if stirred or step.now_ns - self._earlier_ns > COMPARED_S * 1e9:
            self._earlier, self._earlier_ns = now, step.now_ns
        if shift is not None:
            self._moved_ns = step.now_ns
            height, width = (side / SHRUNK / COARSE for side in now.shape)
            x, y = shift.moved(width / 2, height / 2)
            self.offset = self.offset[0] + x - width / 2, self.offset[1] + y - height / 2
        self.moves = step.now_ns - self._moved_ns <= MOVES_FOR_S * 1e9
        return shift or Shift.none()

    @staticmethod
    def _shrunk(coarse: Image) -> Image:
        size = max(1, round(coarse.shape[1] * SHRUNK)), max(1, round(coarse.shape[0] * SHRUNK))
        return np.asarray(cv2.cvtColor(cv2.resize(coarse, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY), np.uint8)

    @staticmethod
    def _room(people: Mask, like: Image) -> Mask:
        shrunk = cv2.resize(people, like.shape[1::-1], interpolation=cv2.INTER_NEAREST)
        return np.asarray(cv2.bitwise_not(shrunk), np.uint8)

    @staticmethod
    def _is_stirred(earlier: Image, now: Image, room: Mask) -> bool:
        _, differs = cv2.threshold(cv2.absdiff(earlier, now), STIRRED_LEVELS, 255, cv2.THRESH_BINARY)
        return cv2.countNonZero(cv2.bitwise_and(differs, room)) > STIRRED * max(1, cv2.countNonZero(room))

    @staticmethod
    def _fitted(earlier: Image, now: Image, room: Mask) -> Shift | None:
        """The motion that most corners of the room agree on; none where they do not, or do not move."""
        corners = cv2.goodFeaturesToTrack(earlier, CORNERS, QUALITY, APART_PX, mask=room)
        if corners is None or len(corners) < LEAST_CORNERS:
            return None
        found = corners.copy()
        found, seen, _ = cv2.calcOpticalFlowPyrLK(earlier, now, corners, found, winSize=FLOW_WINDOW, maxLevel=FLOW_LEVELS)
        followed = seen.ravel() > 0
        before, after = corners.reshape(-1, 2)[followed], found.reshape(-1, 2)[followed]
        if len(before) < LEAST_CORNERS:
            return None
        matrix, agree = cv2.estimateAffinePartial2D(before, after, method=cv2.RANSAC, ransacReprojThreshold=AGREE_PX)
        if matrix is None or int(agree.sum()) < max(LEAST_CORNERS, LEAST_SHARE * len(corners)):
            return None
        inside = before[agree.ravel() > 0]
        went = inside @ matrix[:, :2].T + matrix[:, 2] - inside
        if float(np.median(np.hypot(went[:, 0], went[:, 1]))) < LEAST_PX:
            return None
        shrunk = Shift(np.asarray(matrix, np.float64))
        return Shift(shrunk.of_size(1 / (SHRUNK * COARSE)))
