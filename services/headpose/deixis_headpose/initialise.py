"""Start of a head: where it is while it looks into the camera.

The horizontal centre matters most: 10 % off costs 18 to 29 degrees (PERCEPTION.md). So several frontal faces that the
tracker saw (single ones landed on shirts and furniture) must agree, and their mean counts.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from deixis_runtime.lens import Pinhole
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import FrontalFace, Point

from .head import Array, Pose, facing_camera
from .sight import LEAST_FACE_PX, Sight

AGREE = np.array([0.144, 0.144, 0.12])
"""Sightings agree when their centre (x, y) and width differ by less than this, face widths."""
REMEMBERED_S = 2.0
"""Older sightings say nothing of where the head is now."""
NEAREST_M = 0.2
"""No head is seen from so near: what seems to be is a face that is no face, or a lens that is not as it is told."""


class Initialiser:
    """Collects the sightings of one person's frontal face until `views` of them agree."""

    def __init__(self, views: int) -> None:
        self._needed = views
        self._sightings: deque[tuple[int, Array]] = deque(maxlen=2 * views + 1)

    def update(self, face: FrontalFace | None, centre_px: Point, now_ns: int) -> FrontalFace | None:
        """Take the sighting of one frame, if there is one; give the face where it is now, once enough agree.

        Sightings are compared relative to the track's centre `centre_px`, so that a person may walk meanwhile.
        """
        if face is None:
            return None
        offset = np.array([face.centre_px[0] - centre_px[0], face.centre_px[1] - centre_px[1], face.width_px])
        self._sightings.append((now_ns, offset))
        while now_ns - self._sightings[0][0] > REMEMBERED_S * 1e9:
            self._sightings.popleft()
        seen = np.array([sighting for _, sighting in self._sightings])
        middle = np.median(seen, axis=0)
        agree = np.all(np.abs(seen - middle) < AGREE * middle[2], axis=1)
        if agree.sum() < self._needed or not agree[-1]:
            return None
        x, y, width = (float(v) for v in seen[agree].mean(axis=0))
        return FrontalFace(centre_px=(centre_px[0] + x, centre_px[1] + y), width_px=width)


def frontal_of(sight: Sight) -> FrontalFace | None:
    """The face that the tracker saw from the front, where it is one that a head can have; else none."""
    face = sight.face.frontal
    if face is None or face.width_px < LEAST_FACE_PX or sight.camera.focal_px * FACE_WIDTH_M < NEAREST_M * face.width_px:
        return None
    return face


def frontal_pose(face: FrontalFace, camera: Pinhole) -> Pose:
    """Pose of the head that shows this frontal face and looks into the camera."""
    depth = camera.focal_px * FACE_WIDTH_M / face.width_px
    x = (face.centre_px[0] - camera.centre_x_px) * depth / camera.focal_px
    y = (face.centre_px[1] - camera.centre_y_px) * depth / camera.focal_px
    position = np.array([x, y, depth])
    return Pose(facing_camera(position), position)
