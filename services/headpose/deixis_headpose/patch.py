"""The picture around one head: grey, at a size independent of the distance, in pyramid levels with gradients."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .head import Array

FINER = 2
"""Heads that are more than so many times wider than they are worked at are shrunk by whole pixels before all else: of a face
that fills the picture, or that a message says is thousands of pixels wide, the square would not fit into memory."""


@dataclass(frozen=True)
class Level:
    """One pyramid level: (H, W, 3) float32 of intensity and its derivatives along x and y, and the scale from the picture."""

    planes: NDArray[np.float32]
    origin_px: tuple[float, float]
    scale: float

    def sample(self, pixels: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Intensity (N,), gradient (N, 2) per picture pixel and whether it lies inside (N,), at picture pixels (N, 2)."""
        if not len(pixels):  # OpenCV raises there
            return np.zeros(0), np.zeros((0, 2)), np.zeros(0, np.bool_)
        at = ((pixels - self.origin_px + 0.5) * self.scale - 0.5).astype(np.float32)
        height, width = self.planes.shape[:2]
        inside = (at[:, 0] >= 1) & (at[:, 1] >= 1) & (at[:, 0] <= width - 2) & (at[:, 1] <= height - 2)
        values = np.asarray(
            cv2.remap(self.planes, at[:, 0], at[:, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float64
        )
        values = values.reshape(-1, 3)
        return values[:, 0], values[:, 1:] * self.scale, inside


def pyramid(
    picture: NDArray[np.uint8], centre_px: tuple[float, float], head_width_px: float, working_width_px: float, levels: int
) -> list[Level]:
    """Cut a square of three head widths about `centre_px` out of a BGR or grey picture; finest level first.

    The square is scaled down so that the head is at most `working_width_px` wide; small heads are not scaled up, for that
    adds cost and no information. Parts outside the picture repeat its border.
    """
    times = max(1, int(head_width_px / (FINER * working_width_px)))
    wide = head_width_px / times
    half = max(int(np.ceil(1.5 * wide)), 2**levels)  # of the narrowest head, too, the coarsest level has a few pixels
    left, top = (round((at + 0.5) / times - 0.5) - half for at in centre_px)
    cut = _cut(picture, left, top, 2 * half, times)
    grey = cv2.cvtColor(cut, cv2.COLOR_BGR2GRAY) if cut.ndim == 3 else cut
    size = min(2 * half, round(2 * half * working_width_px / wide))
    image: NDArray[np.float32] = grey.astype(np.float32)
    if size < 2 * half:
        image = np.asarray(cv2.resize(image, (size, size), interpolation=cv2.INTER_AREA), np.float32)
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.8), np.float32)
    result = []
    for _ in range(levels):
        dx = cv2.Sobel(image, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
        dy = cv2.Sobel(image, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
        origin, scale = (float(left * times), float(top * times)), image.shape[0] / (2 * half * times)
        result.append(Level(np.asarray(cv2.merge([image, dx, dy]), np.float32), origin, scale))
        image = np.asarray(cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.float32)
    return result


def _cut(picture: NDArray[np.uint8], left: int, top: int, size: int, times: int) -> NDArray[np.uint8]:
    """A square with its corner and size in blocks of `times` x `times` pixels, each their mean."""
    rows, columns = (
        np.clip(np.arange(first, first + size), 0, max(extent // times, 1) - 1)
        for first, extent in zip((top, left), picture.shape, strict=False)
    )
    part = picture[rows[0] * times : (rows[-1] + 1) * times, columns[0] * times : (columns[-1] + 1) * times]
    seen = rows[-1] - rows[0] + 1, columns[-1] - columns[0] + 1
    if times > 1:
        part = np.asarray(cv2.resize(part, seen[::-1], interpolation=cv2.INTER_AREA), np.uint8)
    if seen == (size, size):
        return part
    return np.ascontiguousarray(part[(rows - rows[0])[:, None], (columns - columns[0])[None, :]])
