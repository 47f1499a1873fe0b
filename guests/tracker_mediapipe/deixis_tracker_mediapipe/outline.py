"""The outline of a hand about its landmarks: palm and fingers as thick as a hand's, without the forearm."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from .seen import Floats, Point

PALM = (0, 1, 5, 9, 13, 17)
FINGERS = ((1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12), (13, 14, 15, 16), (17, 18, 19, 20))
WRIST, MIDDLE, INDEX, LITTLE = 0, 9, 5, 17
# Of a usual adult, cm: from wrist to middle knuckle, across the knuckles; how thick a finger is, and how far flesh goes about
# the joints of the palm.
PALM_LENGTH, PALM_BREADTH = 9.5, 6.5
FINGER, FLESH = 1.8, 0.9
MARGIN_PX = 2
DRAWN_PX = 128.0
"""Size the outline is drawn in at most: of a hand that fills the picture no finer one is needed."""

Contour = NDArray[np.int32]


def outline_of(points: Floats) -> Contour:
    """Outline (n, 2) of a hand with these landmarks (21, 2), pixels of the picture; empty where they are one point."""
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low).max())
    if not extent > 0:
        return np.empty((0, 2), np.int32)
    scale = min(1.0, DRAWN_PX / extent)
    centimetre = max(
        float(np.hypot(*(points[MIDDLE] - points[WRIST]))) / PALM_LENGTH,
        float(np.hypot(*(points[LITTLE] - points[INDEX]))) / PALM_BREADTH,
    )
    border = MARGIN_PX + int(np.ceil(FINGER * centimetre * scale))
    drawn = np.rint((points - low) * scale).astype(np.int32) + border
    size = np.ceil((high - low) * scale).astype(int) + 2 * border + 1
    mask = np.zeros((size[1], size[0]), np.uint8)
    palm = cv2.convexHull(drawn[list(PALM)])
    cv2.fillConvexPoly(mask, palm, 255)
    cv2.polylines(mask, [palm], True, 255, _thick(2 * FLESH * centimetre * scale))
    for finger in FINGERS:
        for one, other in pairwise(drawn[list(finger)].tolist()):
            cv2.line(mask, one, other, 255, _thick(FINGER * centimetre * scale))
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    largest = max(outlines, key=cv2.contourArea)[:, 0, :]
    return np.asarray(np.rint((largest - border) / scale + low), np.int32)


def centroid_of(outline: Contour, points: Floats) -> Point:
    """The middle of the outline's area; of the landmarks where it has none."""
    moments = cv2.moments(outline) if len(outline) else {"m00": 0.0}
    if not moments["m00"]:
        x, y = points.mean(axis=0)
        return float(x), float(y)
    return moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]


def _thick(width: float) -> int:
    return max(1, round(width))
