"""One frame as the tracker has it: its place in time, and its pictures at working resolution, at half of it, through windows.

What the tracker does is timed in seconds, so that every frame rate gives the same tracks.

A quarter of the pixels costs a quarter of the time, and averaging four pixels takes away most of the sensor's noise: so room,
skin and silhouettes are judged coarsely. Outlines of hands are refined at full resolution, inside the few regions found.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]

COARSE = 0.5
SLACK_NS = 4_000_000  # stamps are rounded, and cameras jitter: what is due a moment later is due now


class Step(NamedTuple):
    """One frame: steady time, time since the run began, and since the frame before (never longer than half a second)."""

    now_ns: int
    run_ns: int
    passed_ns: int

    @property
    def passed_s(self) -> float:
        """Since the frame before."""
        return self.passed_ns / 1e9

    def periods(self, period_s: float, ahead_s: float = 0.0) -> int:
        """How many periods ended since the frame before: 0 where what is done once a period is not due.

        `ahead_s` shifts the beats, so that not all work falls into the same frames.
        """
        period_ns, now_ns = round(period_s * 1e9), self.run_ns + round(ahead_s * 1e9) + SLACK_NS
        return now_ns // period_ns - (now_ns - self.passed_ns) // period_ns

    def kept(self, share_per_s: float) -> float:
        """What is left of a quantity of which that share is left after a second."""
        return float(share_per_s**self.passed_s)

    def learned(self, share_per_s: float) -> float:
        """How far to move toward the new, where after a second that share of the old is left."""
        return 1 - self.kept(share_per_s)


def repeated(rate: float, times: int) -> float:
    """How far `times` moves by `rate` toward the same goal lead."""
    return float(1 - (1 - rate) ** times)


class Views(NamedTuple):
    """One frame: as given, and `scale` of its pixels to one of the working picture; `full` (H, W, 3) at working resolution;
    `coarse`, P(skin) and what changed at half of it.
    """

    frame: Image
    scale: float
    full: Image
    coarse: Image
    skin: Image
    changed: Mask


class Box(NamedTuple):
    """Left, top, width, height in pixels."""

    x: float
    y: float
    w: float
    h: float

    @property
    def centre(self) -> tuple[float, float]:
        """Centre (x, y)."""
        return self.x + self.w / 2, self.y + self.h / 2

    def scaled(self, factor: float) -> Box:
        """The same box in a picture scaled by `factor`."""
        return Box(self.x * factor, self.y * factor, self.w * factor, self.h * factor)

    def window(self, height: int, width: int) -> tuple[slice, slice]:
        """Rows and columns of the part inside a picture; empty slices when it lies outside."""
        x0, x1 = _inside(self.x, self.x + self.w, width)
        y0, y1 = _inside(self.y, self.y + self.h, height)
        return slice(y0, y1), slice(x0, x1)


def _inside(start: float, end: float, limit: int) -> tuple[int, int]:
    first, last = int(start), round(end)
    first = 0 if first < 0 else min(first, limit)
    return first, first if last < first else min(last, limit)


def around(x: float, y: float, left: float, top: float, right: float, bottom: float) -> Box:
    """Box that reaches so far from a point in each direction."""
    return Box(x - left, y - top, left + right, top + bottom)


def coarsened(image: Image) -> Image:
    """(H, W, 3) at half resolution."""
    size = (max(1, image.shape[1] // 2), max(1, image.shape[0] // 2))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def to_frame(x: float, y: float, scale: float) -> tuple[float, float]:
    """A point of the working picture in the frame; pixel centres are at integers."""
    return (x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5
