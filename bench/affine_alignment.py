"""What one would build with OpenCV alone: the face patch aligned by cv2.findTransformECC, its turn read off the affine map.

The patch is that of the first frontal view. Where the face no longer looks like it, it is aligned to the last frame instead,
drawn back into the patch's own coordinates, so that each map is one from the first view: a chain without a sum of angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from deixis_schemas.messages import Point
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Array = NDArray[np.float64]

FACE_PX = 64
"""Width of a face as it is worked on."""
CANVAS_PX = 160
PATCH_PX = (46, 58)
"""Width and height of the patch: within the face, so that nothing behind it is aligned."""
RADIUS = 0.56
"""How far a turn by one radian moves the patch, face widths: fitted to rendered heads, as are the gates."""
GATE, CHAIN_GATE = 0.90, 0.80
"""Correlation below which the first view does not do, and below which the last frame does not do either."""
LEAST_SQUEEZE = 0.12
"""A patch narrower than this, by its width from the front, says nothing any more."""
STEPS, EPSILON, SMOOTHING = 50, 1e-4, 5
LOST_NS = 500_000_000


@dataclass
class FacePatch:
    """One face followed from its first frontal view on. `offset`: of the face from the track's centre then, face widths."""

    patch: Picture
    width_px: float
    offset: Point
    warp: Array
    aligned_ns: int
    last: Picture

    @staticmethod
    def of(picture: Picture, centre: Point, face_centre: Point, width_px: float, now_ns: int) -> FacePatch:
        """Begin with a frontal face in a picture (h, w, 3), BGR; `centre` is the track's."""
        canvas = canvas_of(picture, face_centre, width_px)
        offset = ((face_centre[0] - centre[0]) / width_px, (face_centre[1] - centre[1]) / width_px)
        warp = frontal_warp()
        patch = drawn_back(canvas, warp)
        return FacePatch(patch, width_px, offset, warp, now_ns, patch)

    def follow(self, picture: Picture, centre: Point, now_ns: int) -> float | None:
        """Yaw in the next frame, degrees; none where the face is not found again."""
        place = (centre[0] + self.offset[0] * self.width_px, centre[1] + self.offset[1] * self.width_px)
        canvas = canvas_of(picture, place, self.width_px)
        found = align(self.patch, canvas, self.warp, GATE)
        if found is None:  # a chain that has gone astray ends where the face is seen from the front again
            found = align(self.patch, canvas, likeliest_warp(self.patch, canvas), GATE)
        if found is None:
            found = align(self.last, canvas, self.warp, CHAIN_GATE)
        if found is None:
            return None
        self.warp, self.last, self.aligned_ns = found, drawn_back(canvas, found), now_ns
        return yaw_of(found)

    def is_lost(self, now_ns: int) -> bool:
        """Whether it has not been found for too long."""
        return now_ns - self.aligned_ns > LOST_NS


def canvas_of(picture: Picture, centre: Point, width_px: float) -> Picture:
    """The face about `centre` in grey, FACE_PX wide, in the middle of a square of CANVAS_PX."""
    scale, middle = FACE_PX / width_px, (CANVAS_PX - 1) / 2
    matrix = np.array([[scale, 0, middle - scale * centre[0]], [0, scale, middle - scale * centre[1]]])
    drawn = cv2.warpAffine(picture, matrix, (CANVAS_PX, CANVAS_PX), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.cvtColor(drawn, cv2.COLOR_BGR2GRAY), np.uint8)


def align(patch: Picture, canvas: Picture, start: Array, gate: float) -> Array | None:
    """The affine map (2, 3) of the patch's pixels to the canvas, from `start` on; none below the gate."""
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, STEPS, EPSILON)
    warp = start.astype(np.float32)
    try:
        score, warp = cv2.findTransformECC(patch, canvas, warp, cv2.MOTION_AFFINE, criteria, None, SMOOTHING)  # type: ignore
    except cv2.error:  # it does not converge, or has left the picture
        return None
    found = np.asarray(warp, np.float64)
    return found if score >= gate and squeeze_of(found) > LEAST_SQUEEZE else None


def drawn_back(canvas: Picture, warp: Array) -> Picture:
    """The patch as the canvas shows it, in the patch's own pixels."""
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(canvas, warp, PATCH_PX, flags=flags, borderMode=cv2.BORDER_REPLICATE), np.uint8)


def squeeze_of(warp: Array) -> float:
    """Width of the patch across its own vertical by its height, 1 as seen from the front."""
    down = warp[:, 1]
    return float(np.linalg.det(warp[:, :2]) / (down @ down))


def yaw_of(warp: Array) -> float:
    """Yaw of a patch, degrees, by how far the patch has moved from the head's axis.

    In proportion, not by the sine: the patch moves on toward the half of the face that is still seen. Roll and distance drop
    out, being those of the patch's vertical. How narrow the patch has become is not used: it is the same on either side, and a
    face is no plane, so that its patch is half as wide at 38 degrees already.
    """
    down = warp[:, 1]
    scale = float(np.linalg.norm(down))
    middle = warp[:, :2] @ ((np.array(PATCH_PX) - 1) / 2) + warp[:, 2] - (CANVAS_PX - 1) / 2
    moved = float(middle @ np.array([down[1], -down[0]])) / scale
    return math.degrees(moved / (RADIUS * FACE_PX * scale))


def likeliest_warp(patch: Picture, canvas: Picture) -> Array:
    """The map (2, 3) of the patch's pixels to where the canvas looks most like it, unturned."""
    place = cv2.minMaxLoc(cv2.matchTemplate(canvas, patch, cv2.TM_CCOEFF_NORMED))[3]
    return np.hstack([np.eye(2), np.array(place, np.float64)[:, None]])


def frontal_warp() -> Array:
    """The map (2, 3) of the patch's pixels to the canvas for a face seen from the front."""
    return np.hstack([np.eye(2), ((CANVAS_PX - np.array(PATCH_PX)) / 2)[:, None]])
