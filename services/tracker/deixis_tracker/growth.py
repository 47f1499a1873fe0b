"""Ways inside a mask: what is reached from one of its pixels, step by step.

A mask is held as one long number, a bit for each pixel, so that a step is a few shifts of it. For the small masks of arms that
is ten times as quick as dilating pictures. Steps go to all eight neighbours and to the next four in turn, so that what is
reached in an open place is an octagon, nearly a circle.
"""

from __future__ import annotations

import numpy as np

from deixis_tracker.frame import Mask

Pixel = tuple[int, int]


def farthest(mask: Mask, seed: Pixel) -> tuple[Pixel, int]:
    """The pixel (x, y) of a mask that is reached last from the `seed`, the first in reading order, and the steps to it."""
    ground = _Ground(mask)
    reached = last = ground.pixel(seed)
    steps = 0
    while (grown := ground.grown(reached, steps + 1)) != reached:
        last, reached, steps = grown ^ reached, grown, steps + 1
    return ground.first_of(last), steps


def within(mask: Mask, seed: Pixel, steps: int) -> Mask:
    """What of a mask is reached from the `seed` (x, y) in so many steps, 0 or 1."""
    ground = _Ground(mask)
    reached = ground.pixel(seed)
    for step in range(1, steps + 1):
        grown = ground.grown(reached, step)
        if grown == reached:
            break
        reached = grown
    return ground.mask_of(reached)


class _Ground:
    """A mask as a number. The first pixel in reading order is the highest bit; a column of 0 keeps rows apart."""

    def __init__(self, mask: Mask) -> None:
        self._height, width = (int(side) for side in mask.shape)
        self._row = width + 1
        rows = np.zeros((self._height, self._row), np.uint8)
        rows[:, :width] = mask
        self._bytes = -(-int(rows.size) // 8)
        self._ground: int = int.from_bytes(np.packbits(rows).tobytes(), "big")

    def pixel(self, at: Pixel) -> int:
        return 1 << (8 * self._bytes - 1 - (at[1] * self._row + at[0]))

    def first_of(self, pixels: int) -> Pixel:
        y, x = divmod(8 * self._bytes - pixels.bit_length(), self._row)
        return x, y

    def grown(self, pixels: int, step: int) -> int:
        row = self._row
        beside = pixels | pixels << 1 | pixels >> 1
        upright = beside if step % 2 else pixels
        return (beside | upright << row | upright >> row) & self._ground

    def mask_of(self, pixels: int) -> Mask:
        bits = np.unpackbits(np.frombuffer(pixels.to_bytes(self._bytes, "big"), np.uint8), count=self._height * self._row)
        return np.ascontiguousarray(bits.reshape(self._height, self._row)[:, :-1])
