"""From whatever arrives to what is published: 8 bits, grey or BGR, within bounds, as bytes, with intrinsics for its size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from deixis_schemas.messages import FrameEncoding
from numpy.typing import NDArray

from .calibration import Calibration, CalibrationError, Intrinsics
from .config import CameraConfig
from .sources import Image, PictureRefused

SMALLEST_SIDE_PX = 64
BIT_DEPTHS = (8, 10, 12, 14, 16)

Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class Encoded:
    """Pixels as they travel."""

    width: int
    height: int
    encoding: FrameEncoding
    data: bytes


class Preparation:
    """Prepares the pictures of one source; `note` is told, under a key, what is done to them."""

    def __init__(self, config: CameraConfig, calibration: Calibration, note: Callable[[str, str], None]) -> None:
        self._calibration = calibration
        self._note = note
        self._normaliser = Normaliser(config.max_width)
        self._notes: dict[str, str] = {}

    def prepare(self, image: Image, quality: int | None) -> tuple[Encoded, Intrinsics]:
        """The picture as it is published, a JPEG of `quality` or raw (None), and how it projects. Raises PictureRefused."""
        pixels = self._normaliser.normalise(image)
        try:
            intrinsics = self._calibration.for_size(pixels.shape[1], pixels.shape[0])
        except CalibrationError as error:
            raise PictureRefused(str(error)) from None
        if pixels.shape[:2] != image.shape[:2]:
            self._note_change("scaled", f"pictures of {_size(image)} are scaled down to {_size(pixels)}")
        if self._normaliser.deep:
            self._note_change("depth", f"16-bit pictures are taken as {self._normaliser.bits}-bit and published as 8-bit")
        return encode(pixels, quality), intrinsics

    def _note_change(self, key: str, text: str) -> None:
        if self._notes.get(key) != text:
            self._notes[key] = text
            self._note(key, text)


class Normaliser:
    """Brings pictures of one source to 8-bit grey or BGR of at most `longest_px` a side.

    Remembers one thing: the bit depth that 16-bit pictures have used so far (`bits`; `deep` where there were any). Many cameras
    put 10 or 12 bits into 16; taken at their word such pictures are black.
    """

    def __init__(self, longest_px: int) -> None:
        self._longest_px = longest_px
        self.bits = 8
        self.deep = False

    def normalise(self, image: Image) -> Pixels:
        """(H, W) grey or (H, W, 3) BGR. Raises PictureRefused for a size, depth or number of channels that has no use."""
        if image.ndim not in (2, 3):
            raise PictureRefused(f"picture has {image.ndim} dimensions instead of 2 or 3")
        if min(image.shape[:2]) < SMALLEST_SIDE_PX:
            raise PictureRefused(f"picture of {_size(image)} is smaller than {SMALLEST_SIDE_PX} pixels a side")
        return np.ascontiguousarray(self._to_8_bits(self._shrink(_without_alpha(image))))

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
        self.bits = max(self.bits, next(bits for bits in BIT_DEPTHS if peak < 1 << bits))
        return np.right_shift(image, self.bits - 8, dtype=np.uint16).astype(np.uint8)


def encode(pixels: Pixels, quality: int | None) -> Encoded:
    """The bytes of a (H, W) or (H, W, 3) picture: a JPEG of `quality` 1 to 100, or raw (None; `mono8` where it is grey).

    Raises PictureRefused where the JPEG coder fails.
    """
    height, width = pixels.shape[:2]
    if quality is None:
        return Encoded(width, height, "mono8" if pixels.ndim == 2 else "bgr8", pixels.tobytes())
    good, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not good:
        raise PictureRefused(f"picture of {width} x {height} cannot be made a JPEG")
    return Encoded(width, height, "jpeg", data.tobytes())


def _without_alpha(image: Image) -> Image:
    channels = image.shape[2] if image.ndim == 3 else 1
    if channels == 1:
        return image.reshape(image.shape[:2])
    if channels == 3:
        return image
    if channels == 4:
        return np.ascontiguousarray(image[:, :, :3])
    raise PictureRefused(f"picture has {channels} channels instead of 1 (grey), 3 (BGR) or 4 (BGR and alpha)")


def _size(image: Image) -> str:
    return f"{image.shape[1]} x {image.shape[0]}"
