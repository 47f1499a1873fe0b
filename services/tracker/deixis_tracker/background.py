"""Background subtraction that does not swallow a person who stands still (Pateraki et al. 2011, sec. 4, [2]).

A running mean of the room, frozen under tracked people. A person who stands there from the first frame is part of that
mean; such a place is marked unknown: no change there says nothing. A change of the light moves most of the picture at once:
one gain per channel is fitted to the room first, and what the gain cannot explain is relearned quickly when it covers much
of the picture. When the camera moves, the room moves with its picture (`camera_motion.py`).
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.camera_motion import Matrix, Shift
from deixis_tracker.frame import COARSE, Box, Image, Mask, Step, repeated
from deixis_tracker.median import median

UPDATE_S = 0.1
STEADY_RATE, CHANGED_RATE = 0.1, 0.02  # of learning, per update
OLD_ROOM_KEPT = (1 - 0.35) ** 30  # of the room before a change of the light, per second
LIGHT_SETTLES_S = 0.35
GRID = 6  # the gain is fitted on every 6th pixel of the coarse picture
UPHEAVAL = 0.35  # share of changed room beyond which the light, not a person, changed
SAME_LIGHT = 0.01  # a gain so near 1 is not worth a pass over the picture
SHADOW_CHROMA = 0.07
SHADOW_DARKEST = 0.35
LOG_LEVELS = np.log(np.arange(256, dtype=np.float32) + 6)
MOVING_RATE = 0.1  # of learning, per frame, while the camera moves: a room that is moved again and again becomes blurred
EDGES = np.ones((3, 3), np.uint8)  # of the room, which lie a little aside while the camera moves
DOUBT_FADES = 13  # of 255, per update: what the camera's motion laid bare, or a person left, is known after two seconds
MOTION_THRESHOLD, MOTION_THRESHOLD_MOVING = 14, 30
MOTION_FADES_PER_S = 480.0  # of 255


class Background:
    """Mean picture of the room, at the resolution of the first one. Call `changed`, then `update`, once a frame."""

    def __init__(self, image: Image, threshold: int) -> None:
        """Start from the first (H, W, 3) BGR picture; `threshold` in grey levels."""
        self._mean = image.astype(np.float32)
        self._shown = image.copy()
        self._threshold = threshold
        self._doubt: Mask = np.zeros(image.shape[:2], np.uint8)
        self._moves = False
        self.unstable = False  # the light changed just now: what differs from the room is no person
        self._settled_ns = 0
        self._expected = self._shown

    def mark_unknown(self, box: Box) -> None:
        """Say that a person covers `box` in the mean."""
        rows, columns = box.window(*self._doubt.shape)
        self._doubt[rows, columns] = 255

    @property
    def unknown(self) -> Mask:
        """255 where the room is not known, else 0."""
        return np.asarray(cv2.threshold(self._doubt, 0, 255, cv2.THRESH_BINARY)[1], np.uint8)

    def move(self, image: Image, shift: Shift, moves: bool) -> None:
        """Move the room with the picture, before `changed`; `moves`: whether the camera moved just now."""
        self._moves = moves
        if shift.is_none:
            return
        matrix, size = shift.of_size(COARSE), image.shape[1::-1]
        # What is laid bare is taken from the picture, and is no known room yet.
        self._mean = np.asarray(_warped(self._mean, matrix, image.astype(np.float32)), np.float32)
        self._doubt = np.asarray(cv2.warpAffine(self._doubt, matrix, size, flags=cv2.INTER_NEAREST, borderValue=255), np.uint8)
        self._shown = np.asarray(cv2.convertScaleAbs(self._mean), np.uint8)

    def changed(self, image: Image, frozen: Mask) -> Mask:
        """(H, W) uint8, 255 where the picture differs from the room under today's light. `frozen`: 255 where people are."""
        self._expected = self._under_light(image, frozen)
        difference = cv2.absdiff(image, self._expected)
        alike = cv2.inRange(difference, (0, 0, 0), (self._threshold,) * 3)
        changed = np.asarray(cv2.bitwise_not(alike), np.uint8)
        return np.asarray(cv2.morphologyEx(changed, cv2.MORPH_OPEN, EDGES), np.uint8) if self._moves else changed

    @property
    def room(self) -> Image:
        """(H, W, 3) the room as it would look now, under the light of the last picture."""
        return self._expected

    def remove_shadow(self, image: Image, mask: Mask) -> Mask:
        """`mask` without pixels that are the room, darker and of the same colour: the shadow of a person."""
        places = np.flatnonzero(mask != 0)
        if not len(places):
            return mask
        seen, room = (LOG_LEVELS[picture.reshape(-1, 3)[places]] for picture in (image, self._expected))
        ratio = seen - room
        darker = ratio.mean(axis=1)
        same_colour = (np.abs(ratio[:, 2] - ratio[:, 1]) < SHADOW_CHROMA) & (np.abs(ratio[:, 1] - ratio[:, 0]) < SHADOW_CHROMA)
        shadow = same_colour & (darker < 0.05) & (darker > np.log(SHADOW_DARKEST))
        result = mask.copy()
        result.reshape(-1)[places[shadow]] = 0
        return result

    def update(self, image: Image, changed: Mask, frozen: Mask, step: Step) -> None:
        """Learn the room where no person is: steady places quickly, changed ones slowly, all at once when the light changed."""
        room = frozen == 0
        room_size = int(np.count_nonzero(room[::2, ::2]))
        moved = int(np.count_nonzero(changed[::2, ::2] * room[::2, ::2]))
        if room_size and moved > UPHEAVAL * room_size:
            self._settled_ns = step.now_ns + round(LIGHT_SETTLES_S * 1e9)
        self.unstable = step.now_ns < self._settled_ns
        updates = step.periods(UPDATE_S)
        if updates:
            faded = cv2.subtract(self._doubt, np.full_like(self._doubt, min(255, DOUBT_FADES * updates)))
            self._doubt = np.asarray(np.where(room, faded, self._doubt), np.uint8)
        if self.unstable:
            self._learn(image, np.asarray(room, np.uint8), step.learned(OLD_ROOM_KEPT))
        elif self._moves:
            self._learn(image, np.asarray(room, np.uint8), MOVING_RATE)
        elif updates:
            steady = changed == 0
            self._learn(image, np.asarray(room & steady, np.uint8), repeated(STEADY_RATE, updates))
            self._learn(image, np.asarray(room & ~steady, np.uint8), repeated(CHANGED_RATE, updates))
        if self.unstable or self._moves or updates:
            self._shown = np.asarray(cv2.convertScaleAbs(self._mean), np.uint8)

    def _learn(self, image: Image, where: Mask, rate: float) -> None:
        cv2.accumulateWeighted(image, self._mean, rate, mask=where)

    def _under_light(self, image: Image, frozen: Mask) -> Image:
        """The room under today's light: one gain per channel, the median ratio over the room."""
        grid = np.s_[GRID // 2 :: GRID, GRID // 2 :: GRID]
        free = frozen[grid] == 0
        seen = image[grid][free].astype(np.float32)
        room = self._shown[grid][free].astype(np.float32)
        gains = []
        for c in range(3):
            usable = (room[:, c] > 20) & (room[:, c] < 245) & (seen[:, c] < 245)
            gains.append(float(median(seen[usable, c] / room[usable, c])) if usable.sum() >= 20 else 1.0)
        if max(abs(gain - 1) for gain in gains) < SAME_LIGHT:
            return self._shown
        levels = np.arange(256, dtype=np.float32)[:, None] * np.array(gains, np.float32)
        table = np.clip(levels, 0, 255).astype(np.uint8)[None]
        return np.asarray(cv2.LUT(self._shown, table), np.uint8)


class MotionHistory:
    """Where something moved lately: 255 now, fading. Half the size of the coarse picture."""

    def __init__(self, image: Image) -> None:
        self._last = self._small(image)
        self.history: Mask = np.zeros_like(self._last)

    def update(self, image: Image, shift: Shift, step: Step) -> None:
        """Take in the next picture, in which the room has moved by `shift`."""
        small, threshold = self._small(image), MOTION_THRESHOLD
        if not shift.is_none:
            matrix, size, threshold = shift.of_size(COARSE / 2), small.shape[1::-1], MOTION_THRESHOLD_MOVING
            self.history = np.asarray(cv2.warpAffine(self.history, matrix, size, flags=cv2.INTER_NEAREST), np.uint8)
            self._last = np.asarray(_warped(self._last, matrix, small), np.uint8)
        moved = cv2.threshold(cv2.absdiff(small, self._last), threshold, 255, cv2.THRESH_BINARY)[1]
        fade = np.full_like(self.history, min(255, round(MOTION_FADES_PER_S * step.passed_s)))
        self.history = np.asarray(cv2.max(cv2.subtract(self.history, fade), moved), np.uint8)
        self._last = small

    @staticmethod
    def _small(image: Image) -> Image:
        size = (max(1, image.shape[1] // 2), max(1, image.shape[0] // 2))
        return np.asarray(cv2.cvtColor(cv2.resize(image, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY), np.uint8)


def _warped(picture: NDArray[Any], matrix: Matrix, bare: NDArray[Any]) -> NDArray[Any]:
    """A picture moved by a matrix; what that lays bare is taken from `bare`, of the same size and type."""
    size = picture.shape[1::-1]
    return cv2.warpAffine(picture, matrix, size, bare.copy(), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_TRANSPARENT)
