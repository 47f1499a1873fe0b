"""Which pixels may be hands: skin-coloured, and either changed against the room or where the room is not known."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.background import Background
from deixis_tracker.boxes import around
from deixis_tracker.config import TrackerConfig
from deixis_tracker.persons import Person
from deixis_tracker.skin import hysteresis

Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]

MOTION_THRESHOLD = 14
MOTION_FADE = 16  # of 255 a frame


class Blob(NamedTuple):
    """One connected region in a window whose corner is at (x0, y0); `mask` is 0 or 1."""

    mask: Mask
    x0: int
    y0: int
    area: int
    evidence: float


class MotionHistory:
    """Where something moved lately: 255 now, fading. A quarter of the picture's size."""

    def __init__(self, image: Image) -> None:
        self._last = self._small(image)
        self.history: Mask = np.zeros_like(self._last)

    def update(self, image: Image) -> None:
        """Take in the next picture."""
        small = self._small(image)
        moved = cv2.threshold(cv2.absdiff(small, self._last), MOTION_THRESHOLD, 255, cv2.THRESH_BINARY)[1]
        self.history = np.asarray(cv2.max(cv2.subtract(self.history, np.full_like(self.history, MOTION_FADE)), moved), np.uint8)
        self._last = small

    @staticmethod
    def _small(image: Image) -> Image:
        size = (max(1, image.shape[1] // 4), max(1, image.shape[0] // 4))
        return np.asarray(cv2.cvtColor(cv2.resize(image, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY), np.uint8)


def head_zone(shape: tuple[int, int], persons: list[Person]) -> Mask:
    """255 on heads and necks: skin there is no hand."""
    zone = np.zeros(shape, np.uint8)
    for person in persons:
        x, y, w = person.x, person.y, person.width
        cv2.ellipse(zone, (round(x), round(y)), (round(0.6 * w), round(0.8 * w)), 0, 0, 360, 255, -1)
        cv2.rectangle(zone, (round(x - 0.42 * w), round(y)), (round(x + 0.42 * w), round(y + 1.25 * w)), 255, -1)
    return zone


def hand_blobs(
    image: Image,
    skin: Image,
    changed: Mask,
    background: Background,
    motion: MotionHistory,
    persons: list[Person],
    config: TrackerConfig,
) -> list[Blob]:
    """Skin-coloured regions that may be hands of the persons, largest first."""
    candidates = cv2.bitwise_and(cv2.inRange(skin, config.skin_low, 255), changed)
    foreground = background.remove_shadow(image, np.asarray(candidates, np.uint8))
    # Where the room is not known only the colour speaks, so it has to be sure: trousers, shirts and wood floors are
    # nearly skin.
    sure = cv2.bitwise_and(background.unknown, cv2.inRange(skin, config.skin_high, 255))
    allowed = cv2.bitwise_or(foreground, np.asarray(sure, np.uint8))
    allowed[head_zone((skin.shape[0], skin.shape[1]), persons) > 0] = 0
    probability = cv2.bitwise_and(skin, allowed)
    smooth = np.asarray(cv2.medianBlur(probability, 3), np.uint8)
    least = config.min_hand_area * min(p.width for p in persons) ** 2
    labels, stats, kept = hysteresis(smooth, config.skin_low, config.skin_high, max(12, int(least)))
    blobs = []
    for k in kept:
        x, y, w, h, area = (int(v) for v in stats[k])
        mask = np.asarray(labels[y : y + h, x : x + w] == k, np.uint8)
        blobs.append(Blob(mask, x, y, area, _evidence(mask, x, y, foreground, motion)))
    return sorted(blobs, key=lambda b: -b.area)[:24]


def _evidence(mask: Mask, x: int, y: int, foreground: Mask, motion: MotionHistory) -> float:
    """How much of a blob changed against the room or moved lately, 0 to 1."""
    h, w = mask.shape
    changed = cv2.mean(foreground[y : y + h, x : x + w], mask)[0] / 255
    box = around(x + w / 2, y + h / 2, w / 2 + 4, h / 2 + 4, w / 2 + 4, h / 2 + 4).scaled(0.25)
    rows, columns = box.window(*motion.history.shape)
    part = motion.history[rows, columns]
    moved = float(np.count_nonzero(part)) / max(1, part.size)
    return min(1.0, max(changed, 2.5 * moved))
