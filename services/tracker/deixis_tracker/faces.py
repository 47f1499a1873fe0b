"""Faces seen from the front, by a Haar cascade (Viola and Jones 2001): looked for where a head is, and measured.

How wide and where the box of the cascade is on a face depends by up to 12 % on the size at which the cascade sees it. So a
place is looked at quickly at one size, and measured at several in turn, whose mean counts.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import cv2
import cv2.data
import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import FrontalFace

from deixis_tracker.frame import Box, Image, around

FRONTAL = "haarcascade_frontalface_alt2"
WINDOW_PX = 20  # of that cascade
LOOKED_AT_PX = 32  # a place that is looked at is scaled to this width of a face
MEASURED_AT_PX = (56.0, 62.0, 68.0)
MEASURED_BOX_M, MEASURED_BOX_DROP_M = 0.197, 0.006  # width of the box so measured, and how far below the head's centre it is


class _Found(NamedTuple):
    """Centre and width of a box of the cascade, pixels of the frame."""

    x: float
    y: float
    width: float


@cache
def load_cascade() -> cv2.CascadeClassifier:
    """The cascade, which OpenCV ships. Raises RuntimeError where this build has none (5.x wheels)."""
    cascade = cv2.CascadeClassifier(f"{cv2.data.haarcascades}{FRONTAL}.xml")
    if cascade.empty():
        raise RuntimeError(f"{FRONTAL}.xml: not in this build of OpenCV ({cv2.__version__}); Deixis needs 4.x")
    return cascade


def look(picture: Image, x: float, y: float, width: float) -> Box | None:
    """The face near (x, y) of (H, W, 3) that is about `width` wide, as a Haar box; None when none is seen there."""
    box = around(x, y, 1.15 * width, 1.15 * width, 1.15 * width, 1.15 * width)
    rows, columns = box.window(*picture.shape[:2])
    scale = LOOKED_AT_PX / width
    if min(picture[rows, columns].shape[:2]) * scale < WINDOW_PX * 1.1:
        return None
    part = cv2.cvtColor(picture[rows, columns], cv2.COLOR_BGR2GRAY)
    size = (round(part.shape[1] * scale), round(part.shape[0] * scale))
    small = cv2.resize(part, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    least, most = (round(LOOKED_AT_PX * f) for f in (0.74, 1.32))
    found = load_cascade().detectMultiScale(small, 1.07, 2, minSize=(least, least), maxSize=(most, most))
    if not len(found):
        return None
    middle = np.array([(x - columns.start) * scale, (y - rows.start) * scale])
    best = min(found, key=lambda f: float(np.hypot(f[0] + f[2] / 2 - middle[0], f[1] + f[3] / 2 - middle[1])))
    fx, fy = size[0] / part.shape[1], size[1] / part.shape[0]
    return Box(columns.start + best[0] / fx, rows.start + best[1] / fy, best[2] / fx, best[3] / fy)


def measure(frame: Image, seen: Box, turn: int) -> FrontalFace | None:
    """What `look` has seen, measured; both in pixels of the (H, W, 3) frame. None where it does not show at another size.

    One of the sizes is used in each `turn`: whoever takes the mean of three turns has that of all three.
    """
    x, y = seen.centre
    found = _find(frame, _Found(x, y, seen.w), MEASURED_AT_PX[turn % len(MEASURED_AT_PX)])
    if not found:
        return None
    box = min(found, key=lambda f: np.hypot(f.x - x, f.y - y))
    head_y = box.y - MEASURED_BOX_DROP_M / MEASURED_BOX_M * box.width
    return FrontalFace(centre_px=(box.x, head_y), width_px=FACE_WIDTH_M / MEASURED_BOX_M * box.width)


def _find(frame: Image, face: _Found, at_px: float) -> list[_Found]:
    """The face again, with its box scaled to `at_px`; none where it is not seen so."""
    side, scale = round(1.5 * face.width), at_px / face.width
    left, top = max(0, round(face.x - side / 2)), max(0, round(face.y - side / 2))
    cut = frame[top : top + side, left : left + side]
    least, most = round(0.8 * at_px), round(1.25 * at_px)
    if min(cut.shape[:2]) * scale < least:
        return []
    grey = cv2.cvtColor(cut, cv2.COLOR_BGR2GRAY)
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    boxes = load_cascade().detectMultiScale(small, 1.05, 3, minSize=(least, least), maxSize=(most, most))
    found = [_Found(left + (x + w / 2) / scale - 0.5, top + (y + h / 2) / scale - 0.5, w / scale) for x, y, w, h in boxes]
    return [again for again in found if np.hypot(again.x - face.x, again.y - face.y) < 0.2 * face.width]
