"""Start of a head: where it is while it looks into the camera.

The horizontal centre matters most: 10 % off costs 18 to 29 degrees (PERCEPTION.md). So several frontal detections must
agree, each found inside the track's surroundings only (single ones landed on shirts and furniture), and their median counts.
"""

from __future__ import annotations

from collections import deque
from functools import cache
from typing import NamedTuple

import cv2
import cv2.data
import numpy as np
from numpy.typing import NDArray

from .head import Array, Camera, Pose, facing_camera

SEARCH_WIDTH_PX = 130
"""Side of the scaled search window: a face as wide as the track says is 50 px wide in it."""
MEASURED_AT_PX = (56.0, 62.0, 68.0)
"""Widths of the detector's box at which a found face is measured again: the width that the detector says depends by up to 12 %
on the size at which it sees the face, and tracks are 8 % narrower to 37 % wider than the face."""
AGREE = 0.12
"""Detections agree when their centre and width differ by less than this share of the width."""


class FrontalFace(NamedTuple):
    """Box of the frontal-face detector: centre and width in picture pixels."""

    x: float
    y: float
    width: float


@cache
def _frontal_detector() -> cv2.CascadeClassifier:
    detector = cv2.CascadeClassifier(cv2.data.haarcascades + "haarcascade_frontalface_alt2.xml")
    if detector.empty():
        raise RuntimeError("OpenCV's haarcascade_frontalface_alt2.xml is missing: install opencv-python-headless 4.14")
    return detector


def find_frontal_face(grey: NDArray[np.uint8], centre_px: tuple[float, float], width_px: float) -> FrontalFace | None:
    """The frontal face nearest to where a track says one is (centre, face width); none where there is none.

    Faces between 0.6 and 2.2 of the said width are looked for, in a square of 2.6 of it. The one found is then measured at
    sizes that do not depend on the track.
    """
    found = _nearest_face(grey, centre_px, width_px)
    return None if found is None else _measured(grey, found)


def _nearest_face(grey: NDArray[np.uint8], centre_px: tuple[float, float], width_px: float) -> FrontalFace | None:
    side = round(2.6 * width_px)
    face = SEARCH_WIDTH_PX / 2.6
    found = _detect(grey, centre_px, side, SEARCH_WIDTH_PX / side, (round(0.6 * face), round(2.2 * face)))
    return min(found, key=lambda f: np.hypot(f.x - centre_px[0], f.y - centre_px[1]), default=None)


def _measured(grey: NDArray[np.uint8], face: FrontalFace) -> FrontalFace:
    """The mean of the detections of a found face at several sizes; as found where it is not found again."""
    again = []
    for width in MEASURED_AT_PX:
        limits = round(0.8 * width), round(1.25 * width)
        again += _detect(grey, (face.x, face.y), round(1.7 * face.width), width / face.width, limits)
    near = [f for f in again if np.hypot(f.x - face.x, f.y - face.y) < 0.2 * face.width]
    return FrontalFace(*(float(v) for v in np.mean(near, axis=0))) if near else face


def _detect(
    grey: NDArray[np.uint8], centre_px: tuple[float, float], side: int, scale: float, limits: tuple[int, int]
) -> list[FrontalFace]:
    """Frontal faces in a square of the picture, scaled by `scale`; limits: smallest and largest box in the scaled square."""
    left, top = max(0, round(centre_px[0] - side / 2)), max(0, round(centre_px[1] - side / 2))
    cut = grey[top : top + side, left : left + side]
    if min(cut.shape) * scale < limits[0]:
        return []
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    window = cv2.resize(cut, None, fx=scale, fy=scale, interpolation=method)
    boxes = _frontal_detector().detectMultiScale(window, 1.05, 3, minSize=(limits[0],) * 2, maxSize=(limits[1],) * 2)
    return [FrontalFace(left + (x + w / 2) / scale - 0.5, top + (y + h / 2) / scale - 0.5, w / scale) for x, y, w, h in boxes]


class Initialiser:
    """Collects the frontal detections of one person until enough agree."""

    def __init__(self, views: int) -> None:
        self._needed = views
        self._offsets: deque[Array] = deque(maxlen=2 * views + 1)

    def update(self, face: FrontalFace | None, centre_px: tuple[float, float]) -> FrontalFace | None:
        """Take the detection of one frame; give the face where it is now, once enough agree.

        Detections are compared relative to the track's centre `centre_px`, so that a person may walk meanwhile.
        """
        if face is None:
            return None
        self._offsets.append(np.array([face.x - centre_px[0], face.y - centre_px[1], face.width]))
        seen = np.array(self._offsets)
        middle = np.median(seen, axis=0)
        agree = np.all(np.abs(seen - middle) < AGREE * middle[2], axis=1)
        if agree.sum() < self._needed or not agree[-1]:
            return None
        x, y, width = seen[agree].mean(axis=0)
        return FrontalFace(centre_px[0] + x, centre_px[1] + y, width)


def frontal_pose(face: FrontalFace, camera: Camera, haar_width_m: float, haar_drop_m: float) -> Pose:
    """Pose of the head that shows this frontal face and looks into the camera."""
    depth = camera.focal_px * haar_width_m / face.width
    x = (face.x - camera.centre_x_px) * depth / camera.focal_px
    y = (face.y - camera.centre_y_px) * depth / camera.focal_px - haar_drop_m
    position = np.array([x, y, depth])
    return Pose(facing_camera(position), position)
