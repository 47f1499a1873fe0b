"""The coarse picture: half the working resolution, in which room, skin and silhouettes are judged.

A quarter of the pixels costs a quarter of the time, and averaging four pixels takes away most of the sensor's noise. Outlines
of hands are refined at full resolution, inside the few regions found (`segmentation.py`).
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

COARSE = 0.5


def coarsened(image: Image) -> Image:
    """(H, W, 3) at half resolution."""
    size = (max(1, image.shape[1] // 2), max(1, image.shape[0] // 2))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
