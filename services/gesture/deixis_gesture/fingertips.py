"""Fingertips of a hand: how many stand out, and where.

The paper's rules (section 4, [18]) look at "the number and the posture of the distinguishable fingertips". At VGA and two
metres a finger is five pixels wide and the curvature of its outline is mostly noise (a study: right in 30 % of the frames), so
a finger is found as what a morphological opening wider than a finger takes away, and its tip as its point of largest distance
from the palm, where the outline's curvature has its maximum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from .hand import CELLS, CHEST, HandShape

# Wider than a finger (0.10 to 0.16 face widths, blurred up to 0.2), narrower than a wrist (0.3).
OPENING = 0.26
LEAST_LENGTH = 0.16
LEAST_FINGER_AREA = 0.012
# Beyond this angle from the arm's direction a thin thing is the wrist or a sleeve, not a finger.
FARTHEST_FROM_ARM_DEG = 115.0


@dataclass(frozen=True)
class Finger:
    """A finger that stands out: its tip, face widths, and its length beyond the palm."""

    tip: tuple[float, float]
    length: float


def find_fingers(hand: HandShape) -> list[Finger]:
    """Fingers of the hand, the longest first."""
    size = round(OPENING * CELLS) | 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    palm = np.asarray(cv2.morphologyEx(hand.mask, cv2.MORPH_OPEN, kernel), np.uint8)
    if not palm.any():
        return []
    thin = hand.mask & (1 - palm)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(thin, connectivity=4)
    beyond = cv2.distanceTransform(1 - palm, cv2.DIST_L2, 3)
    fingers = []
    for label in range(1, count):
        if stats[label, cv2.CC_STAT_AREA] < LEAST_FINGER_AREA * CELLS**2:
            continue
        rows, columns = np.nonzero(labels == label)
        length = float(beyond[rows, columns].max()) / CELLS
        tip = _tip(hand, rows, columns)
        if length >= LEAST_LENGTH and _points_away(hand, tip):
            fingers.append(Finger(tip, length))
    return sorted(fingers, key=lambda finger: -finger.length)


def _tip(hand: HandShape, rows: np.ndarray, columns: np.ndarray) -> tuple[float, float]:
    x = hand.origin[0] + columns / CELLS - hand.palm[0]
    y = hand.origin[1] + rows / CELLS - hand.palm[1]
    far = int(np.argmax(x * x + y * y))
    return hand.palm[0] + float(x[far]), hand.palm[1] + float(y[far])


def _points_away(hand: HandShape, tip: tuple[float, float]) -> bool:
    arm = math.atan2(hand.palm[1] - CHEST[1], hand.palm[0] - CHEST[0])
    finger = math.atan2(tip[1] - hand.palm[1], tip[0] - hand.palm[0])
    return abs(math.remainder(finger - arm, 2 * math.pi)) <= math.radians(FARTHEST_FROM_ARM_DEG)
