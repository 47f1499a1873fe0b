"""From a picture of ROS to what is published: within bounds, as raw bytes or JPEG. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from deixis_schemas.messages import FrameEncoding

from .pictures import Jpeg, PictureRefused, Pixels, decoded

SMALLEST_SIDE_PX = 64
Wanted = Literal["auto", "bgr8", "jpeg"]


@dataclass(frozen=True)
class Prepared:
    """Pixels as they travel."""

    width: int
    height: int
    encoding: FrameEncoding
    data: bytes


def prepare(picture: Pixels | Jpeg, wanted: Wanted, quality: int, longest_px: int) -> Prepared:
    """Scale down where a side is longer than `longest_px`, and encode. Raises PictureRefused.

    `auto` leaves a JPEG as it came and the rest raw.
    """
    if isinstance(picture, Jpeg):
        if wanted != "bgr8" and max(picture.width, picture.height) <= longest_px:
            _check_smallest(picture.width, picture.height)
            return Prepared(picture.width, picture.height, "jpeg", picture.data)
        as_jpeg, pixels = wanted != "bgr8", decoded(picture.data)
    else:
        as_jpeg, pixels = wanted == "jpeg", picture
    pixels = _shrunk(pixels, longest_px)
    height, width = pixels.shape[:2]
    _check_smallest(width, height)
    if not as_jpeg:
        return Prepared(width, height, "mono8" if pixels.ndim == 2 else "bgr8", pixels.tobytes())
    good, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not good:
        raise PictureRefused(f"picture of {width} x {height} cannot be made a JPEG")
    return Prepared(width, height, "jpeg", data.tobytes())


def _shrunk(pixels: Pixels, longest_px: int) -> Pixels:
    height, width = pixels.shape[:2]
    scale = longest_px / max(width, height)
    if scale >= 1:
        return pixels
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)


def _check_smallest(width: int, height: int) -> None:
    if min(width, height) < SMALLEST_SIDE_PX:
        raise PictureRefused(f"picture of {width} x {height} is smaller than {SMALLEST_SIDE_PX} pixels a side")
