"""MediaPipe's FaceMesh on the crop about a face. The model comes with the wheel; nothing is downloaded."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from mediapipe import solutions
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Floats = NDArray[np.floating[Any]]
Box = tuple[float, float, float, float]

CROP_PX = 256
CROP_HALF = 0.95
"""Half the side of the crop about a face, by the longer side of its box."""
SMALLEST_CROP_PX = 24


class FaceMesh:
    """The mesh of one person's face, from frame to frame: a face that is followed is not looked for, which saves half the time
    and sees it turned farther.
    """

    def __init__(self, confidence: float) -> None:
        self._graph = solutions.face_mesh.FaceMesh(
            max_num_faces=1, min_detection_confidence=confidence, min_tracking_confidence=confidence
        )

    def find(self, bgr: Picture, box: Box) -> Floats | None:
        """Landmarks (n, 3) of the face in a box, pixels of the picture, z in the same scale; none where there is no face."""
        x, y, w, h = box
        side = round(2 * CROP_HALF * max(w, h))
        if not SMALLEST_CROP_PX <= side <= 4 * max(bgr.shape[:2]):
            return None
        left, top = round(x + w / 2 - side / 2), round(y + h / 2 - side / 2)
        crop = square_of(bgr, left, top, side)
        if crop is None:
            return None
        found = self._graph.process(cv2.cvtColor(crop, cv2.COLOR_BGR2RGB))
        if not found.multi_face_landmarks:
            return None
        points = np.array([(p.x, p.y, p.z) for p in found.multi_face_landmarks[0].landmark])
        return points * side + (left, top, 0.0)

    def forget(self) -> None:
        """Begin anew, for another person."""
        self._graph.reset()


def square_of(picture: Picture, left: int, top: int, side: int) -> Picture | None:
    """The square of a picture, CROP_PX wide, black where it lies outside; none where all of it does."""
    rows, columns = slice(max(0, top), max(0, top + side)), slice(max(0, left), max(0, left + side))
    part = picture[rows, columns]
    if not part.size:
        return None
    scale = CROP_PX / side
    width, height = max(1, round(part.shape[1] * scale)), max(1, round(part.shape[0] * scale))
    square = np.zeros((CROP_PX, CROP_PX, 3), np.uint8)
    across, down = round(max(0, -left) * scale), round(max(0, -top) * scale)
    small = cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    room = square[down : down + height, across : across + width]
    room[:] = small[: room.shape[0], : room.shape[1]]
    return square
