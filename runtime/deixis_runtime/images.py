"""Frames as arrays, for the stages that look at pictures (extra `images`)."""

from __future__ import annotations

import cv2
import numpy as np
from deixis_schemas.messages import Frame
from numpy.typing import NDArray

# SOF0 to SOF15, less the tables DHT, JPG and DAC that lie between.
START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


class ImageError(ValueError):
    """A frame whose picture cannot be read."""


def decode_image(frame: Frame) -> NDArray[np.uint8]:
    """The picture of a frame as (height, width, 3) uint8, BGR; may be read-only. Raises ImageError."""
    if frame.encoding == "bgr8":
        return np.frombuffer(frame.data, np.uint8).reshape(frame.height, frame.width, 3)
    if frame.encoding == "mono8":
        grey = np.frombuffer(frame.data, np.uint8).reshape(frame.height, frame.width)
        return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)
    size = jpeg_size(frame.data)
    if size != (frame.width, frame.height):
        raise ImageError(f"data: a JPEG of {size[0]} x {size[1]} in a frame of {frame.width} x {frame.height}")
    try:
        image = cv2.imdecode(np.frombuffer(frame.data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error as error:
        raise ImageError(f"data: {error.err}") from None
    if image is None:
        raise ImageError("data: not a JPEG picture")
    if image.shape[:2] != size[::-1]:
        raise ImageError(f"data: the JPEG of {size[0]} x {size[1]} is to be shown turned")
    return np.asarray(image, np.uint8)


def jpeg_size(data: bytes) -> tuple[int, int]:
    """Width and height from the header of a JPEG, which OpenCV tells only after decoding. Raises ImageError.

    A few hundred bytes can claim a picture of 65535 x 65535, whose decoding takes 12 GB.
    """
    at = 2
    while data[:2] == b"\xff\xd8" and at + 9 <= len(data) and data[at] == 0xFF:
        marker, length = data[at + 1], int.from_bytes(data[at + 2 : at + 4])
        if marker in START_OF_FRAME:
            return int.from_bytes(data[at + 7 : at + 9]), int.from_bytes(data[at + 5 : at + 7])
        # A marker may be preceded by any number of 0xFF.
        at += 1 if marker == 0xFF else 2 + length
    raise ImageError("data: not a JPEG picture")
