"""Whether what stands in a place sways: people do, by a pixel or so within a second; vases, busts and pictures never.

Two pictures of the place are laid over one another by least squares: a shift, a gain and an offset, for light changes. Noise
moves the shift of a head by some hundredths of a pixel; phase correlation took it for a sway.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.frame import Box, Image, around

CELLS, BLUR_CELLS = 40, 1.2
HALF = 0.9  # head widths: what is compared around the middle of a head
APART_S = 0.3  # between the pictures, at least
LEAST_PX, MOST_PX = 0.35, 4.0  # of a sway, pixels of the working picture; more is somebody else who passes
LEAST_EXPLAINED = 0.3  # share of the difference that the shift explains, beside gain and offset
LEAST_LEVELS = 4.0  # deviation of grey levels: an even patch has no place


@dataclass(frozen=True)
class Glimpse:
    """A place as it was seen at a time."""

    box: Box
    picture: NDArray[Any]
    seen_ns: int

    @classmethod
    def of(cls, picture: Image, x: float, y: float, width: float, now_ns: int) -> Glimpse | None:
        """The surroundings of a head at (x, y) of the picture (H, W, 3); none where they are not whole in it, or even."""
        half = HALF * width
        return cls._in(picture, around(x, y, half, half, half, half), now_ns)

    @classmethod
    def _in(cls, picture: Image, box: Box, now_ns: int) -> Glimpse | None:
        rows, columns = box.window(*picture.shape[:2])
        part = picture[rows, columns]
        if min(part.shape[:2]) < 0.95 * box.w or min(part.shape[:2]) < 4:
            return None
        grey = cv2.cvtColor(part, cv2.COLOR_BGR2GRAY)
        cells = cv2.resize(grey, (CELLS, CELLS), interpolation=cv2.INTER_AREA).astype(np.float32)
        cells = np.asarray(cv2.GaussianBlur(cells, (0, 0), BLUR_CELLS), np.float32)
        return cls(box, cells, now_ns) if float(cells.std()) >= LEAST_LEVELS else None

    def sways(self, picture: Image, now_ns: int) -> bool:
        """Whether the place has moved since by as much as people who stand do."""
        if now_ns - self.seen_ns < APART_S * 1e9:
            return False
        now = self._in(picture, self.box, now_ns)
        if now is None:
            return False
        shift_cells, explained = _shift(self.picture, now.picture)
        moved_px = shift_cells * self.box.w / CELLS
        return explained >= LEAST_EXPLAINED and LEAST_PX <= moved_px <= MOST_PX


def _shift(before: NDArray[Any], now: NDArray[Any]) -> tuple[float, float]:
    """How far a picture (h, w) has moved, pixels, and which share of the difference that explains beside gain and offset."""
    down, right = np.gradient(before)
    light = np.stack([before.ravel(), np.ones(before.size, np.float32)], axis=1)
    unexplained = now.ravel() - light @ np.linalg.lstsq(light, now.ravel(), rcond=None)[0]
    slopes = np.stack([right.ravel(), down.ravel()], axis=1)
    slopes = slopes - light @ np.linalg.lstsq(light, slopes, rcond=None)[0]
    moved = np.linalg.lstsq(slopes, -unexplained, rcond=None)[0]
    left = unexplained + slopes @ moved
    whole = float(unexplained @ unexplained)
    return math.hypot(*moved), 1 - float(left @ left) / whole if whole > 0 else 0.0
