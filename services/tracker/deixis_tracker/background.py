"""Background subtraction that does not swallow a person who stands still (Pateraki et al. 2011, sec. 4, [2]).

A running mean of the room, frozen under tracked people. A person who stands there from the first frame is part of that
mean; such a place is marked unknown: no change there says nothing. A change of the light moves most of the picture at once:
one gain per channel is fitted to the room first, and what the gain cannot explain is relearned quickly when it covers much
of the picture.
"""

from __future__ import annotations

import cv2
import numpy as np

from deixis_tracker.frame import Box, Image, Mask, Step, repeated

UPDATE_S = 0.1
STEADY_RATE, CHANGED_RATE = 0.1, 0.02  # of learning, per update
OLD_ROOM_KEPT = (1 - 0.35) ** 30  # of the room before a change of the light, per second
LIGHT_SETTLES_S = 0.35
GRID = 6  # the gain is fitted on every 6th pixel of the coarse picture
UPHEAVAL = 0.35  # share of changed room beyond which the light, not a person, changed
SAME_LIGHT = 0.01  # a gain so near 1 is not worth a pass over the picture
SHADOW_CHROMA = 0.07
SHADOW_DARKEST = 0.35
MOTION_THRESHOLD = 14
MOTION_FADES_PER_S = 480.0  # of 255


class Background:
    """Mean picture of the room, at the resolution of the first one. Call `changed`, then `update`, once a frame."""

    def __init__(self, image: Image, threshold: int) -> None:
        """Start from the first (H, W, 3) BGR picture; `threshold` in grey levels."""
        self._mean = image.astype(np.float32)
        self._shown = image.copy()
        self._threshold = threshold
        self.unknown: Mask = np.zeros(image.shape[:2], np.uint8)
        self.unstable = False  # the light changed just now: what differs from the room is no person
        self._settled_ns = 0
        self._expected = self._shown

    def mark_unknown(self, box: Box) -> None:
        """Say that a person covers `box` in the mean."""
        rows, columns = box.window(*self.unknown.shape)
        self.unknown[rows, columns] = 255

    def changed(self, image: Image, frozen: Mask) -> Mask:
        """(H, W) uint8, 255 where the picture differs from the room under today's light. `frozen`: 255 where people are."""
        self._expected = self._under_light(image, frozen)
        difference = cv2.absdiff(image, self._expected)
        b, g, r = cv2.split(difference)
        largest = cv2.max(cv2.max(b, g), r)
        return np.asarray(cv2.threshold(largest, self._threshold, 255, cv2.THRESH_BINARY)[1], np.uint8)

    @property
    def room(self) -> Image:
        """(H, W, 3) the room as it would look now, under the light of the last picture."""
        return self._expected

    def remove_shadow(self, image: Image, mask: Mask) -> Mask:
        """`mask` without pixels that are the room, darker and of the same colour: the shadow of a person."""
        rows, columns = np.nonzero(mask)
        if not len(rows):
            return mask
        seen = np.log(image[rows, columns].astype(np.float32) + 6)
        room = np.log(self._expected[rows, columns].astype(np.float32) + 6)
        ratio = seen - room
        darker = ratio.mean(axis=1)
        same_colour = (np.abs(ratio[:, 2] - ratio[:, 1]) < SHADOW_CHROMA) & (np.abs(ratio[:, 1] - ratio[:, 0]) < SHADOW_CHROMA)
        shadow = same_colour & (darker < 0.05) & (darker > np.log(SHADOW_DARKEST))
        result = mask.copy()
        result[rows[shadow], columns[shadow]] = 0
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
        if self.unstable:
            self._learn(image, np.asarray(room, np.uint8), step.learned(OLD_ROOM_KEPT))
        elif updates:
            self._learn(image, np.asarray(room & (changed == 0), np.uint8), repeated(STEADY_RATE, updates))
            self._learn(image, np.asarray(room & (changed != 0), np.uint8), repeated(CHANGED_RATE, updates))

    def _learn(self, image: Image, where: Mask, rate: float) -> None:
        cv2.accumulateWeighted(image, self._mean, rate, mask=where)
        self._shown = np.asarray(cv2.convertScaleAbs(self._mean), np.uint8)

    def _under_light(self, image: Image, frozen: Mask) -> Image:
        """The room under today's light: one gain per channel, the median ratio over the room."""
        grid = np.s_[GRID // 2 :: GRID, GRID // 2 :: GRID]
        free = frozen[grid] == 0
        seen = image[grid][free].astype(np.float32)
        room = self._shown[grid][free].astype(np.float32)
        gains = []
        for c in range(3):
            usable = (room[:, c] > 20) & (room[:, c] < 245) & (seen[:, c] < 245)
            gains.append(float(np.median(seen[usable, c] / room[usable, c])) if usable.sum() >= 20 else 1.0)
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

    def update(self, image: Image, step: Step) -> None:
        """Take in the next picture."""
        small = self._small(image)
        moved = cv2.threshold(cv2.absdiff(small, self._last), MOTION_THRESHOLD, 255, cv2.THRESH_BINARY)[1]
        fade = np.full_like(self.history, min(255, round(MOTION_FADES_PER_S * step.passed_s)))
        self.history = np.asarray(cv2.max(cv2.subtract(self.history, fade), moved), np.uint8)
        self._last = small

    @staticmethod
    def _small(image: Image) -> Image:
        size = (max(1, image.shape[1] // 2), max(1, image.shape[0] // 2))
        return np.asarray(cv2.cvtColor(cv2.resize(image, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY), np.uint8)
