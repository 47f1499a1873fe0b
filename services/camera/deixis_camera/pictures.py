"""From whatever arrives to what is published: 8 bits, grey or BGR, within bounds."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .sources import Image, PictureRefused

SMALLEST_SIDE_PX = 64
BIT_DEPTHS = (8, 10, 12, 14, 16)

Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class Normal:
    """A picture as it is published: (H, W) grey or (H, W, 3) BGR, uint8. `arrived_px`: its size before scaling."""

    image: Pixels
    arrived_px: tuple[int, int]

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height)."""
        return self.image.shape[1], self.image.shape[0]

    @property
    def scaled(self) -> bool:
        """Whether it was scaled down."""
        return self.size_px != self.arrived_px


class Normaliser:
    """Brings pictures of one source to 8-bit grey or BGR of at most `longest_px` a side.

    Remembers one thing: the bit depth that 16-bit pictures have used so far. Many cameras put 10 or 12 bits into 16; taken at
    their word such pictures are black.
    """

    def __init__(self, longest_px: int) -> None:
        self._longest_px = longest_px
        self._bits = 8
        self.deep = False

    @property
    def bits(self) -> int:
        """Bits that 16-bit pictures were seen to use."""
        return self._bits

    def normalise(self, image: Image) -> Normal:
        """The picture to publish. Raises PictureRefused for a size, depth or number of channels that has no use."""
        if image.ndim not in (2, 3):
            raise PictureRefused(f"picture has {image.ndim} dimensions instead of 2 or 3")
        height, width = image.shape[:2]
        if min(width, height) < SMALLEST_SIDE_PX:
            raise PictureRefused(f"picture of {width} x {height} is smaller than {SMALLEST_SIDE_PX} pixels a side")
        small = self._shrink(_without_alpha(image))
        return Normal(np.ascontiguousarray(self._to_8_bits(small)), (width, height))

    def _shrink(self, image: Image) -> Image:
        height, width = image.shape[:2]
        scale = self._longest_px / max(width, height)
        if scale >= 1:
            return image
        size = max(1, round(width * scale)), max(1, round(height * scale))
        if min(size) < SMALLEST_SIDE_PX:
            raise PictureRefused(f"picture of {width} x {height} is too narrow: {size[0]} x {size[1]} when scaled down")
        return cv2.resize(image, size, interpolation=cv2.INTER_AREA)

    def _to_8_bits(self, image: Image) -> Pixels:
        if image.dtype == np.uint8:
            return image.astype(np.uint8, copy=False)
        if image.dtype != np.uint16:
            raise PictureRefused(f"picture has {image.dtype} values instead of 8 or 16 bit")
        self.deep = True
        peak = int(image.max())
        self._bits = max(self._bits, next(bits for bits in BIT_DEPTHS if peak < 1 << bits))
        return np.right_shift(image, self._bits - 8, dtype=np.uint16).astype(np.uint8)


def _without_alpha(image: Image) -> Image:
    channels = image.shape[2] if image.ndim == 3 else 1
    if channels == 1:
        return image.reshape(image.shape[:2])
    if channels == 3:
        return image
    if channels == 4:
        return np.ascontiguousarray(image[:, :, :3])
    raise PictureRefused(f"picture has {channels} channels instead of 1 (grey), 3 (BGR) or 4 (BGR and alpha)")
