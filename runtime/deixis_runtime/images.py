"""Frames as arrays, for the stages that look at pictures (extra `images`)."""

from __future__ import annotations

import cv2
import numpy as np
from deixis_schemas.messages import Frame
from numpy.typing import NDArray


class ImageError(ValueError):
    """A frame whose picture cannot be read."""


def decode_image(frame: Frame) -> NDArray[np.uint8]:
    """The picture of a frame as (height, width, 3) uint8, BGR; may be read-only. Raises ImageError."""
    if frame.encoding == "bgr8":
        return np.frombuffer(frame.data, np.uint8).reshape(frame.height, frame.width, 3)
    if frame.encoding == "mono8":
        grey = np.frombuffer(frame.data, np.uint8).reshape(frame.height, frame.width)
        return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)
    try:
        image = cv2.imdecode(np.frombuffer(frame.data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error as error:
        raise ImageError(f"data: {error.err}") from None
    if image is None:
        raise ImageError("data: not a JPEG picture")
    if image.shape[:2] != (frame.height, frame.width):
        raise ImageError(f"data: a JPEG of {image.shape[1]} x {image.shape[0]} in a frame of {frame.width} x {frame.height}")
    return np.asarray(image, np.uint8)
