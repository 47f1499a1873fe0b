"""Tone of a face as measured in the picture: individual typology angle, below -30 dark, above 41 light."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .label_image import Mask

ENOUGH_PX = 20


def skin_tone(picture_bgr: NDArray[np.uint8], face: Mask) -> dict[str, Any]:
    """Mean L, a, b and the angle over a face's pixels (h, w); empty where too little of it is seen."""
    if np.count_nonzero(face) <= ENOUGH_PX:
        return {}
    pixels = picture_bgr[face][None].astype(np.float32) / 255
    lightness, red_green, yellow_blue = (float(value) for value in cv2.cvtColor(pixels, cv2.COLOR_BGR2LAB)[0].mean(axis=0))
    return {
        "face_lab_frame0": [round(lightness, 1), round(red_green, 1), round(yellow_blue, 1)],
        "face_ITA_deg": round(math.degrees(math.atan2(lightness - 50, yellow_blue)), 1),
    }
