"""Cuts the hand from a blob of hand and bare forearm.

With short sleeves the skin blob is the whole arm. The hand is its far end: about one head width along the blob from the
tip, where the tip is the point farthest along the blob (geodesically, for elbows are bent) from where the arm comes from,
the shoulder.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.frame import Mask
from deixis_tracker.growth import farthest, within

LEAST_THICKNESS = 0.22  # head widths; folds of a sleeve and rims of furniture are thinner
CELLS_PER_WIDTH = 12  # resolution at which ways along an arm are measured
NEAR_SHOULDER = 1.2  # head widths: a blob that starts so near the shoulder starts with the upper arm


class Hand(NamedTuple):
    """A hand in a window whose corner is at (x0, y0): its mask (0 or 1), area, centroid and tip in pixels of the picture."""

    mask: Mask
    x0: int
    y0: int
    area: int
    centroid: tuple[float, float]
    tip: tuple[float, float]
    arm_length_px: float


def cut_hand(
    mask: Mask,
    x0: int,
    y0: int,
    shoulder: tuple[float, float],
    head_width_px: float,
    length: float,
    expected: tuple[float, float] | None,
) -> Hand:
    """The hand at the far end of a blob.

    `mask` (0 or 1) is a window at (x0, y0) that holds one blob; `shoulder` is where the arm starts, `length` that of a hand in
    head widths, `expected` the predicted centroid where the hand is already tracked: it overrules the shoulder, for a forearm
    held up in front of the shoulder has its hand at the near end.
    """
    if math.hypot(*mask.shape) <= length * head_width_px:
        return _whole(mask, x0, y0, shoulder)
    factor = min(1.0, CELLS_PER_WIDTH / head_width_px)
    small = mask if factor == 1 else _shrink(mask, factor)
    offset = np.array([x0, y0], float)
    near = _closest(small, (np.array(shoulder) - offset) * factor)
    far, whole = farthest(small, near)
    tip = far
    if expected is not None and whole > 1.2 * length * head_width_px * factor:
        target = (np.array(expected) - offset) * factor
        half = 0.5 * length * head_width_px * factor
        ends = [_toward(np.array(far), np.array(near), half), _toward(np.array(near), np.array(far), half)]
        away = [float(np.hypot(*(end - target))) for end in ends]
        from_body = float(np.hypot(*(np.array(near) / factor + offset - shoulder))) / head_width_px
        if from_body > NEAR_SHOULDER and away[1] < 0.5 * away[0] and away[1] < half:
            tip = near
    keep = within(small, tip, int(length * head_width_px * factor))
    if factor != 1:
        keep = np.asarray(cv2.resize(keep, (mask.shape[1], mask.shape[0]), interpolation=cv2.INTER_NEAREST), np.uint8)
    hand = mask & keep
    return _measured(hand, x0, y0, (x0 + tip[0] / factor, y0 + tip[1] / factor), whole / factor)


def hand_about(mask: Mask, x0: int, y0: int, place: tuple[float, float], reach_px: float, like: Hand) -> Hand | None:
    """What of a blob lies within `reach_px` of a place, if anything does; its tip is what is nearest to that of `like`."""
    rows, columns = np.nonzero(mask)
    near = np.hypot(columns + x0 - place[0], rows + y0 - place[1]) <= reach_px
    if not near.any():
        return None
    rows, columns = rows[near], columns[near]
    part = np.zeros_like(mask)
    part[rows, columns] = 1
    k = int(np.argmin(np.hypot(columns + x0 - like.tip[0], rows + y0 - like.tip[1])))
    return _measured(part, x0, y0, (float(x0 + columns[k]), float(y0 + rows[k])), like.arm_length_px)


def _whole(mask: Mask, x0: int, y0: int, shoulder: tuple[float, float]) -> Hand:
    """A blob that is no longer than a hand: there is nothing to cut."""
    rows, columns = np.nonzero(mask)
    away = np.hypot(columns + x0 - shoulder[0], rows + y0 - shoulder[1])
    k = int(np.argmax(away))
    return _measured(mask, x0, y0, (float(x0 + columns[k]), float(y0 + rows[k])), float(away.max() - away.min()))


def _measured(hand: Mask, x0: int, y0: int, tip: tuple[float, float], arm_length_px: float) -> Hand:
    moments = cv2.moments(hand, binaryImage=True)
    area = max(1.0, moments["m00"])
    centroid = (x0 + moments["m10"] / area, y0 + moments["m01"] / area)
    return Hand(hand, x0, y0, int(area), centroid, tip, arm_length_px)


def thickness(mask: Mask) -> float:
    """Diameter in pixels of the largest circle inside a mask."""
    padded = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    distance = cv2.distanceTransform(padded, cv2.DIST_L2, 3)
    return 2 * float(distance.max()) - 1


def outline(hand: Hand) -> NDArray[np.int32]:
    """Outer contour (N, 2) x, y of the largest part, every border pixel, in pixels of the picture."""
    contours, _ = cv2.findContours(hand.mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE, offset=(hand.x0, hand.y0))
    if not contours:
        return np.empty((0, 2), np.int32)
    return np.asarray(max(contours, key=cv2.contourArea), np.int32).reshape(-1, 2)


def _shrink(mask: Mask, factor: float) -> Mask:
    size = (max(1, round(mask.shape[1] * factor)), max(1, round(mask.shape[0] * factor)))
    covered = cv2.resize(mask * np.uint8(255), size, interpolation=cv2.INTER_AREA)
    small = np.asarray(covered > 60, np.uint8)
    return small if small.any() else np.asarray(covered >= covered.max(), np.uint8)


def _closest(mask: Mask, point: NDArray[np.float64]) -> tuple[int, int]:
    rows, columns = np.nonzero(mask)
    k = int(np.argmin((columns - point[0]) ** 2 + (rows - point[1]) ** 2))
    return int(columns[k]), int(rows[k])


def _toward(start: NDArray[np.int64], end: NDArray[np.int64], length: float) -> NDArray[np.float64]:
    gap = max(1e-6, float(np.hypot(*(end - start))))
    return np.asarray(start + (end - start) * min(1.0, length / gap), np.float64)
