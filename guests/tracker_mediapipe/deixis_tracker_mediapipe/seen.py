"""What MediaPipe shows of one picture, as plain values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Floats = NDArray[np.floating[Any]]
Point = tuple[float, float]
Region = tuple[int, int, int, int]
"""x, y of the top left corner, width, height; whole pixels within the picture."""


@dataclass(frozen=True)
class FaceSeen:
    """A face: middle between the ears, which is the head's own also where it is turned; side of the detector's box; how far
    the nose is from between the ears toward image right, box sides; score. Pixels.
    """

    ears: Point
    side: float
    nose: float
    score: float


@dataclass(frozen=True)
class HandSeen:
    """A hand: its 21 landmarks (21, 2), pixels, in MediaPipe's order; how probable it is the person's own left one."""

    points: Floats
    left: float
