"""What a camera's picture is like, in numbers: light, colour, sharpness."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from deixis_tracker.skin import is_grey
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Box = tuple[float, float, float, float]
BURNT = 250
BLUR_PX = 9
JUDGED_WIDTH_PX = 640
LEAST_EDGE = 12.0
"""Steps of grey that are an edge: less is the sensor's noise."""
EDGE_QUANTILE = 0.98


@dataclass(frozen=True)
class PictureMeasures:
    """light: mean brightness, 0 to 255; burnt: share of pixels at the sensor's end; blur: 0 (as sharp as pixels are) to 1, none
    where there are no edges to judge by; grey: it has no colour.
    """

    light: float
    burnt: float
    blur: float | None
    grey: bool


def measure(image: Image) -> PictureMeasures:
    """Of (h, w, 3) BGR."""
    grey = _grey(image)
    scale = JUDGED_WIDTH_PX / max(grey.shape)
    judged = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else grey
    return PictureMeasures(
        float(grey.mean()), float(np.mean(grey >= BURNT)), blur_of(np.asarray(judged, np.uint8)), is_grey(image)
    )


def light_in(image: Image, box: Box) -> float:
    """Mean brightness of the part of a picture that lies in a box x, y, width, height; of all where that is outside."""
    x, y, w, h = (round(value) for value in box)
    part = image[max(0, y) : max(0, y + h), max(0, x) : max(0, x + w)]
    return float(_grey(part if part.size else image).mean())


def blur_of(grey: Image) -> float | None:
    """How little a picture (h, w) changes when it is blurred (Crete et al. 2007), at its strongest edges, the sharper way.

    A sharp edge loses most of its steps to a blur of nine pixels, one that is blurred already keeps them.
    """
    along = [_kept(grey, axis) for axis in (0, 1)]
    known = [kept for kept in along if kept is not None]
    return min(known) if known else None


def _kept(grey: Image, axis: int) -> float | None:
    size = (1, BLUR_PX) if axis == 0 else (BLUR_PX, 1)
    steps = np.abs(np.diff(grey.astype(np.float32), axis=axis))
    soft = np.abs(np.diff(cv2.blur(grey, size).astype(np.float32), axis=axis))
    edge = max(LEAST_EDGE, float(np.quantile(steps, EDGE_QUANTILE)))
    strong = steps >= edge
    if strong.sum() < 0.0005 * steps.size:
        return None
    return float(soft[strong].sum() / steps[strong].sum())


def _grey(image: Image) -> Image:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
