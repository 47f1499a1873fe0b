"""How the room moves in the picture, for the camera itself moves: a robot turns its head or drives. Pure.

MediaPipe finds hands whatever the room does, but whether a hand is held still shows only against the room.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .seen import Picture, Point

Grey = NDArray[np.uint8]
WIDEST_PX = 320
"""Pictures are compared at this width, which is quicker than at their own."""
CORNERS, QUALITY, APART_PX = 80, 0.02, 6
WINDOW, LEVELS = (11, 11), 2
AGREE_PX, LEAST_CORNERS, LEAST_SHARE = 0.6, 8, 0.5
"""How near corners have to be to a common motion, and how many, and what share of them, make it the room's."""
FARTHEST = 0.04
"""Widths of the picture after which another one is compared with: corners leave it, and change their looks."""
BODY_ASIDE, BODY_ABOVE = 2.2, 1.2
"""Where a person is, face widths from the middle of the face, down to the lower border."""


class Room:
    """Follows corners of what is nobody. The picture compared with stays while the camera stands, so that nothing drifts."""

    def __init__(self) -> None:
        self._first: Grey | None = None
        self._corners: NDArray[np.float32] | None = None
        self._base: Point = (0.0, 0.0)
        self._went: Point = (0.0, 0.0)
        self.offset_px: Point = (0.0, 0.0)
        """How far the room has moved in the middle of the picture since `forget`, x right, y down."""

    def forget(self) -> None:
        """Begin anew, with another run of the camera."""
        self._first, self._corners = None, None
        self._base, self._went, self.offset_px = (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)

    def see(self, rgb: Picture, people: Sequence[tuple[Point, float]]) -> None:
        """The next picture (h, w, 3); people: middle and width, pixels, of each face. What cannot be told stays as it was."""
        scale = min(1.0, WIDEST_PX / rgb.shape[1])
        grey = _shrunk(rgb, scale)
        went = _went(self._first, grey, self._corners, self._went) if self._first is not None else None
        if went is not None:
            self._went = went
            self.offset_px = self._base[0] + went[0] / scale, self._base[1] + went[1] / scale
        if went is None or max(abs(went[0]), abs(went[1])) > FARTHEST * grey.shape[1]:
            self._begin_from(grey, [((x * scale, y * scale), width * scale) for (x, y), width in people])

    def _begin_from(self, grey: Grey, people: Sequence[tuple[Point, float]]) -> None:
        self._first, self._base, self._went = grey, self.offset_px, (0.0, 0.0)
        mask = _nobody(grey, people)
        found: Any = cv2.goodFeaturesToTrack(grey, CORNERS, QUALITY, APART_PX, mask=mask)
        self._corners = found if found is not None and len(found) >= LEAST_CORNERS else None


def _shrunk(rgb: Picture, scale: float) -> Grey:
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    return np.asarray(cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)


def _nobody(grey: Grey, people: Sequence[tuple[Point, float]]) -> Grey:
    """255 where nobody is."""
    mask = np.full_like(grey, 255)
    for (x, y), width in people:
        left, right = (max(0, round(x + side * BODY_ASIDE * width)) for side in (-1, 1))
        mask[max(0, round(y - BODY_ABOVE * width)) :, left:right] = 0
    return mask


def _went(before: Grey, now: Grey, corners: NDArray[np.float32] | None, expected: Point) -> Point | None:
    """How far the middle of the picture went, by the motion that most corners agree on; none where they do not."""
    if corners is None:
        return None
    guess = corners + np.array(expected, np.float32)  # without it, corners that went far are not found again
    found, seen, _ = cv2.calcOpticalFlowPyrLK(
        before, now, corners, guess, winSize=WINDOW, maxLevel=LEVELS, flags=cv2.OPTFLOW_USE_INITIAL_FLOW
    )
    followed = seen.ravel() > 0
    if followed.sum() < LEAST_CORNERS:
        return None
    start, end = corners[followed].reshape(-1, 2), found[followed].reshape(-1, 2)
    matrix, agree = cv2.estimateAffinePartial2D(start, end, method=cv2.RANSAC, ransacReprojThreshold=AGREE_PX)
    if matrix is None or agree.sum() < max(LEAST_CORNERS, LEAST_SHARE * len(corners)):
        return None
    middle = np.array([now.shape[1] / 2, now.shape[0] / 2])
    x, y = matrix[:, :2] @ middle + matrix[:, 2] - middle
    return float(x), float(y)
