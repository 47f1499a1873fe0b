"""From a picture to the bytes of a Frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from deixis_schemas.messages import FrameEncoding
from numpy.typing import NDArray

from .sources import PictureRefused


@dataclass(frozen=True)
class Encoded:
    """Pixels as they travel."""

    width: int
    height: int
    encoding: FrameEncoding
    data: bytes


def encode(image: NDArray[np.uint8], encoding: Literal["bgr8", "jpeg"], quality: int) -> Encoded:
    """The bytes of a (H, W) or (H, W, 3) picture: raw (`mono8` where it is grey) or a JPEG of `quality` 1 to 100.

    Raises PictureRefused where the JPEG coder fails.
    """
    height, width = image.shape[:2]
    if encoding == "bgr8":
        return Encoded(width, height, "mono8" if image.ndim == 2 else "bgr8", image.tobytes())
    good, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not good:
        raise PictureRefused(f"picture of {width} x {height} cannot be made a JPEG")
    return Encoded(width, height, "jpeg", data.tobytes())
