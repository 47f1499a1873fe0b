"""MediaPipe's graphs: pictures in, what they show out. Models come with the wheel; nothing is downloaded."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from mediapipe import solutions

from .config import TrackerConfig
from .seen import FaceSeen, HandSeen, Picture, Region

RANGE_5_M = 1
"""The full-range model. That for short range loses faces farther than 2 m."""
NOSE, RIGHT_EAR, LEFT_EAR = 2, 4, 5
HANDS = 2
MODELS = {"lite": 0, "full": 1}


class FaceFinder:
    """The faces of pictures, each picture for itself."""

    def __init__(self, confidence: float) -> None:
        self._graph = solutions.face_detection.FaceDetection(model_selection=RANGE_5_M, min_detection_confidence=confidence)

    def find(self, rgb: Picture) -> list[FaceSeen]:
        """The faces of a picture (h, w, 3), RGB."""
        height, width = rgb.shape[:2]
        found = []
        for detection in self._graph.process(rgb).detections or ():
            box, points = detection.location_data.relative_bounding_box, detection.location_data.relative_keypoints
            side = box.width * width
            middle = (points[RIGHT_EAR].x + points[LEFT_EAR].x) / 2, (points[RIGHT_EAR].y + points[LEFT_EAR].y) / 2
            nose = (points[NOSE].x - middle[0]) * width / side if side > 0 else math.nan
            if all(map(math.isfinite, (*middle, nose))):
                found.append(FaceSeen((middle[0] * width, middle[1] * height), side, nose, float(detection.score[0])))
        return found


class HandFinder:
    """The hands about one person, from frame to frame: where both are followed, palms need not be looked for."""

    def __init__(self, config: TrackerConfig) -> None:
        self._graph = solutions.hands.Hands(
            max_num_hands=HANDS,
            model_complexity=MODELS[config.hand_model],
            min_detection_confidence=config.palm_confidence,
            min_tracking_confidence=config.hand_confidence,
        )

    def find(self, rgb: Picture, region: Region) -> list[HandSeen]:
        """The hands in a region of a picture (h, w, 3), RGB; landmarks in pixels of the whole picture."""
        left, top, width, height = region
        result: Any = self._graph.process(np.ascontiguousarray(rgb[top : top + height, left : left + width]))
        found = []
        for marks, sides in zip(result.multi_hand_landmarks or (), result.multi_handedness or (), strict=True):
            points = np.array([(mark.x * width + left, mark.y * height + top) for mark in marks.landmark])
            side = sides.classification[0]
            # The model takes the picture for a mirror's: what it calls right is the person's own left.
            found.append(HandSeen(points, side.score if side.label == "Right" else 1 - side.score))
        return found

    def forget(self) -> None:
        """Begin anew, for another person."""
        self._graph.reset()


def rgb_of(bgr: Picture) -> Picture:
    """The picture as MediaPipe wants it."""
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8)
