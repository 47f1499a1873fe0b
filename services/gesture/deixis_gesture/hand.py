"""A hand as its outline shows it, in face widths.

Everything is measured in face widths about the face's centre, so that neither the person's distance nor the camera's
resolution matters. The outline is that of the hand alone: the tracker has cut it from a bare forearm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float32]
Mask = npt.NDArray[np.uint8]

# Pixels of the drawn mask for one face width: a finger (0.12 face widths) is then five pixels wide.
CELLS = 40
# Middle of the chest below the face's centre, face widths (anthropometry: shoulder height).
CHEST = (0.0, 1.6)
# Outlines larger than this, and hands smaller, are none; the first bounds the work as well. Face widths, and their square.
LARGEST_OUTLINE = 8.0
LEAST_AREA = 0.02


@dataclass(frozen=True)
class Face:
    """Scale and origin: the face's centre and width, pixels."""

    x_px: float
    y_px: float
    width_px: float

    def normalised(self, points_px: npt.ArrayLike) -> Points:
        """Points (N, 2) in pixels to face widths about the face's centre, x right, y down."""
        shifted = np.asarray(points_px, np.float32).reshape(-1, 2) - np.array([self.x_px, self.y_px], np.float32)
        return np.asarray(shifted / self.width_px, np.float32)

    def pixels(self, point: tuple[float, float]) -> tuple[float, float]:
        """A point in face widths back to pixels."""
        return self.x_px + point[0] * self.width_px, self.y_px + point[1] * self.width_px


@dataclass(frozen=True)
class HandShape:
    """A hand: drawn mask with the place of its origin, and measures in face widths.

    `mask` is (H, W) uint8 of 0 and 1 with `CELLS` pixels a face width; pixel (0, 0) lies at `origin`. `tip` is the distal
    extremum, `palm` the centre of the largest inscribed circle with radius `palm_radius`.
    """

    mask: Mask
    origin: tuple[float, float]
    tip: tuple[float, float]
    palm: tuple[float, float]
    palm_radius: float
    centroid: tuple[float, float]
    area: float

    @property
    def reach(self) -> float:
        """From the palm's centre to the tip, face widths."""
        return math.dist(self.palm, self.tip)

    @property
    def elevation_deg(self) -> float:
        """Angle of palm -> tip above the horizontal, -90 to 90."""
        return math.degrees(math.atan2(self.palm[1] - self.tip[1], abs(self.tip[0] - self.palm[0])))


def unpack_contour(contour: bytes) -> npt.NDArray[np.int16]:
    """Outline of a Track: packed little-endian int16 pairs -> (N, 2) array, pixels."""
    return np.frombuffer(contour, "<i2").reshape(-1, 2)


def hand_of(outline: Points) -> HandShape | None:
    """The hand with this outline (N, 2), face widths; None where there is too little or too much of it."""
    if len(outline) < 3:
        return None
    low, high = outline.min(axis=0), outline.max(axis=0)
    if float((high - low).max()) > LARGEST_OUTLINE:
        return None
    tip = _distal_extremum(outline)
    origin = low - 2.0 / CELLS
    columns, rows = (int(n) + 5 for n in np.ceil((high - low) * CELLS))
    mask = np.zeros((rows, columns), np.uint8)
    cv2.fillPoly(mask, [np.rint((outline - origin) * CELLS).astype(np.int32)], (1,))
    return _measured(mask, (float(origin[0]), float(origin[1])), (float(tip[0]), float(tip[1])))


def _distal_extremum(outline: Points) -> Points:
    from_chest = outline - np.array(CHEST, np.float32)
    return np.asarray(outline[int(np.argmax((from_chest**2).sum(axis=1)))], np.float32)


def _measured(mask: Mask, origin: tuple[float, float], tip: tuple[float, float]) -> HandShape | None:
    area = float(np.count_nonzero(mask)) / CELLS**2
    if area < LEAST_AREA:
        return None
    depth = cv2.distanceTransform(mask, cv2.DIST_L2, 3)
    _, radius, _, (column, row) = cv2.minMaxLoc(depth)
    moments = cv2.moments(mask, binaryImage=True)
    mean = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
    return HandShape(
        mask,
        origin,
        tip,
        (origin[0] + column / CELLS, origin[1] + row / CELLS),
        radius / CELLS,
        (origin[0] + mean[0] / CELLS, origin[1] + mean[1] / CELLS),
        area,
    )
