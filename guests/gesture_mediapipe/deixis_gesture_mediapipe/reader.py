"""MediaPipe's hand landmarks on the crop about a hand. Models come with the wheel; nothing is downloaded."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from mediapipe import solutions
from numpy.typing import NDArray

from .config import GestureConfig
from .fingers import HandRead

Picture = NDArray[np.uint8]
CROP_PX = 224
CROP_FACE_WIDTHS = 2.6
SMALLEST_CROP_PX = 16
FARTHEST_PX = 32000.0
"""Pixels that the contract holds."""
MODELS = {"lite": 0, "full": 1}


class HandReader:
    """Reads the hands of one camera, each from frame to frame by its track: a palm that is hidden later is still followed."""

    def __init__(self, config: GestureConfig) -> None:
        self._config = config
        self._picture: Picture | None = None
        # A graph takes a tenth of a second to make: the first one now, and not within a frame.
        self._free = [self._made()]
        self._graphs: dict[int, Any] = {}
        self._asked: set[int] = set()
        self.left_out = 0  # raised hands of this frame beyond `max_hands`

    def begin(self, picture: Picture | None) -> None:
        """The next frame (H, W, 3) uint8 BGR; none where there is no picture of it."""
        self._picture, self._asked, self.left_out = picture, set(), 0

    def end(self) -> None:
        """The frame is done: hands that were not asked for are forgotten."""
        for gone in self._graphs.keys() - self._asked:
            graph = self._graphs.pop(gone)
            graph.reset()
            self._free.append(graph)

    def read(self, track_id: int, place: tuple[float, float], face_px: float) -> HandRead | None:
        """The hand about a place, pixels, of somebody with a face of that width; none where it cannot be read."""
        self._asked.add(track_id)
        if self._picture is None:
            return None
        side = round(CROP_FACE_WIDTHS * face_px)
        left, top = round(place[0] - side / 2), round(place[1] - side / 2)
        crop = _square(self._picture, left, top, side)
        graph = self._graph(track_id) if crop is not None else None
        if crop is None or graph is None:
            return None
        result = graph.process(cv2.cvtColor(crop, cv2.COLOR_BGR2RGB))
        if not result.multi_hand_landmarks:
            return None
        points = np.array([(mark.x * side + left, mark.y * side + top) for mark in result.multi_hand_landmarks[0].landmark])
        metric = np.array([(mark.x, mark.y, mark.z) for mark in result.multi_hand_world_landmarks[0].landmark])
        if not (np.isfinite(points).all() and np.isfinite(metric).all()):
            return None
        return HandRead(points.clip(-FARTHEST_PX, FARTHEST_PX), metric)

    def _graph(self, track_id: int) -> Any | None:
        if track_id not in self._graphs:
            if len(self._graphs) >= self._config.max_hands:
                self.left_out += 1
                return None
            self._graphs[track_id] = self._free.pop() if self._free else self._made()
        return self._graphs[track_id]

    def _made(self) -> Any:
        return solutions.hands.Hands(
            max_num_hands=1,
            model_complexity=MODELS[self._config.hand_model],
            min_detection_confidence=self._config.palm_confidence,
            min_tracking_confidence=self._config.hand_confidence,
        )


def _square(picture: Picture, left: int, top: int, side: int) -> Picture | None:
    """The square of a picture, CROP_PX wide, black where it lies outside; none where all of it does, or it is too small."""
    if not SMALLEST_CROP_PX <= side <= 4 * max(picture.shape[:2]):
        return None
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
