"""Applies a table of colours to a picture.

cv2.calcBackProject cannot do it: the Python binding takes a table of three dimensions for one of two with channels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


def look_up(table: Image, image: Image) -> Image:
    """`table` (N, N, N) uint8 over B, G, R, N a power of two up to 32, applied to (H, W, 3): (H, W) uint8."""
    bits = table.shape[0].bit_length() - 1
    # One 16-bit number per colour, built with in-place integer operations: this runs on every pixel of every frame.
    index = image[..., 0].astype(np.uint16)
    index >>= 8 - bits
    for channel in (1, 2):
        index <<= bits
        index |= image[..., channel] >> (8 - bits)
    return np.asarray(np.take(table.ravel(), index, mode="clip"), np.uint8)
