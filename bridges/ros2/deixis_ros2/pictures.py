"""Pictures of ROS as arrays: sensor_msgs/Image and CompressedImage to 8-bit grey or BGR. Pure.

Names of encodings by `sensor_msgs/image_encodings.hpp`; conversions as `cv_bridge` makes them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from deixis_runtime.images import ImageError, jpeg_size
from deixis_schemas.messages import MAX_SIDE_PX
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]
Samples = NDArray[Any]
JPEG_START, PNG_START = b"\xff\xd8", b"\x89PNG\r\n\x1a\n"


class PictureRefused(ValueError):
    """A picture that cannot be used; the text names the field and the cause."""


@dataclass(frozen=True)
class _Layout:
    """How an encoding lies in memory: values per pixel, bytes per value, and what makes grey or BGR of it."""

    channels: int
    depth_bytes: int
    convert: Callable[[Samples], Samples]


@dataclass(frozen=True)
class Jpeg:
    """A picture that came as JPEG: it may go on as it is."""

    width: int
    height: int
    data: bytes


def _by(code: int) -> Callable[[Samples], Samples]:
    return lambda samples: cv2.cvtColor(samples, code)


def _as_it_is(samples: Samples) -> Samples:
    return samples


def _upper_byte(then: Callable[[Samples], Samples]) -> Callable[[Samples], Samples]:
    return lambda samples: then(np.right_shift(samples, 8).astype(np.uint8))


_RGB, _RGBA, _BGRA = _by(cv2.COLOR_RGB2BGR), _by(cv2.COLOR_RGBA2BGR), _by(cv2.COLOR_BGRA2BGR)
_UYVY, _YUYV = _by(cv2.COLOR_YUV2BGR_UYVY), _by(cv2.COLOR_YUV2BGR_YUYV)
# OpenCV names a Bayer pattern by its second row and column, ROS by its first.
LAYOUTS: dict[str, _Layout] = {
    "bgr8": _Layout(3, 1, _as_it_is),
    "8UC3": _Layout(3, 1, _as_it_is),
    "rgb8": _Layout(3, 1, _RGB),
    "bgra8": _Layout(4, 1, _BGRA),
    "rgba8": _Layout(4, 1, _RGBA),
    "mono8": _Layout(1, 1, _as_it_is),
    "8UC1": _Layout(1, 1, _as_it_is),
    "mono16": _Layout(1, 2, _upper_byte(_as_it_is)),
    "bgr16": _Layout(3, 2, _upper_byte(_as_it_is)),
    "rgb16": _Layout(3, 2, _upper_byte(_RGB)),
    "yuv422": _Layout(2, 1, _UYVY),
    "uyvy": _Layout(2, 1, _UYVY),
    "yuv422_yuy2": _Layout(2, 1, _YUYV),
    "yuyv": _Layout(2, 1, _YUYV),
    "bayer_rggb8": _Layout(1, 1, _by(cv2.COLOR_BayerBG2BGR)),
    "bayer_bggr8": _Layout(1, 1, _by(cv2.COLOR_BayerRG2BGR)),
    "bayer_gbrg8": _Layout(1, 1, _by(cv2.COLOR_BayerGR2BGR)),
    "bayer_grbg8": _Layout(1, 1, _by(cv2.COLOR_BayerGB2BGR)),
}


def of_image(message: Any) -> Pixels:
    """(H, W) grey or (H, W, 3) BGR of a sensor_msgs/msg/Image; may look into the message. Raises PictureRefused."""
    layout = LAYOUTS.get(message.encoding)
    if layout is None:
        known = ", ".join(LAYOUTS)
        raise PictureRefused(f"encoding '{message.encoding[:40]}' is none of {known}")
    width, height, step = int(message.width), int(message.height), int(message.step)
    _check_size(width, height)
    if layout.channels == 2 and width % 2:
        raise PictureRefused(f"width: {width} is odd, but {message.encoding} has its colours in pairs of pixels")
    row_bytes = width * layout.channels * layout.depth_bytes
    # The last row need not be padded.
    if step < row_bytes or len(message.data) < step * (height - 1) + row_bytes:
        raise PictureRefused(
            f"data: {len(message.data)} bytes in rows of {step} (step), but {width} x {height} {message.encoding} has "
            f"{row_bytes} a row"
        )
    rows = np.lib.stride_tricks.as_strided(message.data, (height, row_bytes), (step, 1), writeable=False)
    return np.asarray(layout.convert(_samples(rows, layout, width, bool(message.is_bigendian))), np.uint8)


def of_compressed(message: Any) -> Pixels | Jpeg:
    """A sensor_msgs/msg/CompressedImage, JPEG or PNG. Raises PictureRefused, before a few bytes become a huge picture."""
    data = message.data.tobytes()
    if data.startswith(JPEG_START):
        try:
            width, height = jpeg_size(data)
        except ImageError as error:
            raise PictureRefused(str(error)) from None
        _check_size(width, height)
        return Jpeg(width, height, data)
    if not data.startswith(PNG_START) or len(data) < 24:
        raise PictureRefused(f"format '{message.format[:40]}': holds neither JPEG nor PNG")
    _check_size(int.from_bytes(data[16:20]), int.from_bytes(data[20:24]))
    return decoded(data)


def decoded(data: bytes) -> Pixels:
    """(H, W, 3) BGR of a JPEG or PNG file whose size was looked at before. Raises PictureRefused."""
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error as error:
        raise PictureRefused(f"data: {error.err}") from None
    if pixels is None:
        raise PictureRefused("data: the compressed picture cannot be read")
    return np.asarray(pixels, np.uint8)


def _samples(rows: Samples, layout: _Layout, width: int, big_endian: bool) -> Samples:
    """The values of a picture by rows: (H, W) or (H, W, channels)."""
    samples = np.ascontiguousarray(rows)
    if layout.depth_bytes == 2:
        samples = samples.view(">u2" if big_endian else "<u2").astype(np.uint16)
    shape = (samples.shape[0], width) if layout.channels == 1 else (samples.shape[0], width, layout.channels)
    return samples.reshape(shape)


def _check_size(width: int, height: int) -> None:
    if not (1 <= width <= MAX_SIDE_PX and 1 <= height <= MAX_SIDE_PX):
        raise PictureRefused(f"width and height: {width} x {height}; 1 to {MAX_SIDE_PX} pixels a side can be")
