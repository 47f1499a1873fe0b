"""Pictures made small enough to be shown and kept."""

from __future__ import annotations

import cv2
from deixis_runtime.images import decode_image, jpeg_size
from deixis_schemas.messages import Frame

QUALITY = 80


def reduced(frame: Frame, width: int) -> bytes:
    """The picture of a frame as a JPEG of at most `width` pixels across. Raises images.ImageError."""
    if frame.encoding == "jpeg" and frame.width <= width and jpeg_size(frame.data) == (frame.width, frame.height):
        return frame.data
    image = decode_image(frame)
    if frame.width > width:
        size = width, max(1, round(frame.height * width / frame.width))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)  # type: ignore[assignment]
    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes())


def scale(frame_width: int, width: int) -> float:
    """By how much a picture of `frame_width` is made smaller to be at most `width` across."""
    return min(1.0, width / frame_width)
