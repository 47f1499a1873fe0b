"""The lens in a sensor_msgs/CameraInfo, as `camera/info` tells it. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from deixis_runtime.lens import DistortionModel, Lens, LensError, Matrix, check_matrix, same_aspect

COEFFICIENTS: dict[str, tuple[int, ...]] = {"plumb_bob": (4, 5), "rational_polynomial": (8, 12, 14), "equidistant": (4,)}
ROUNDED = 1e-9


class LensRefused(ValueError):
    """A CameraInfo whose lens cannot be used; the text names the field."""


@dataclass(frozen=True)
class RosLens:
    """Intrinsics for pictures of `width` x `height`: K row-major, and where they come from, as one sentence."""

    width: int
    height: int
    camera_matrix: Matrix
    distortion_model: DistortionModel
    distortion: tuple[float, ...]
    source: str

    def fits(self, width: int, height: int) -> bool:
        """Whether pictures of that size have this shape; K is scaled by who reads it."""
        return same_aspect((self.width, self.height), (width, height))


def of_camera_info(message: Any, rectified: bool, topic: str) -> RosLens:
    """The lens that a camera tells of; of `rectified` pictures that of P, without distortion. Raises LensRefused."""
    width, height = int(message.width), int(message.height)
    _check_whole_picture(message)
    matrix = _projection(message) if rectified else _camera_matrix(message)
    try:
        check_matrix(matrix, width, height)
    except LensError as error:
        name = "p" if rectified else "k"
        raise LensRefused(str(error).replace("camera_matrix", name, 1)) from None
    model, distortion = ("none", ()) if rectified else _distortion(message)
    return RosLens(width, height, matrix, model, distortion, f"{'P' if rectified else 'K'} of {topic}")


def assumed(width: int, height: int, horizontal_fov_deg: float) -> RosLens:
    """A pinhole in place of a lens that nobody told."""
    fx, fy, cx, cy = Lens.assumed(width, height, horizontal_fov_deg).matrix
    source = f"assumed from a horizontal field of view of {horizontal_fov_deg:g} degrees, without distortion"
    return RosLens(width, height, (fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0), "none", (), source)


def _check_whole_picture(message: Any) -> None:
    """K is that of the sensor's whole picture: where a part of it is sent, or pixels are joined, it says something else."""
    if max(message.binning_x, message.binning_y) > 1:
        raise LensRefused(f"binning: {message.binning_x} x {message.binning_y}; only 1 x 1 can be used")
    roi = message.roi
    if roi.x_offset or roi.y_offset or (roi.width, roi.height) not in ((0, 0), (message.width, message.height)):
        raise LensRefused("roi: only a part of the picture is sent; only the whole one can be used")


def _projection(message: Any) -> Matrix:
    a, b, c, _, d, e, f, _, g, h, i, _ = _finite("p", message.p)
    return a, b, c, d, e, f, g, h, i


def _camera_matrix(message: Any) -> Matrix:
    a, b, c, d, e, f, g, h, i = _finite("k", message.k)
    return a, b, c, d, e, f, g, h, i


def _finite(name: str, numbers: Iterable[float]) -> list[float]:
    found = [float(number) for number in numbers]
    if not all(map(math.isfinite, found)):
        raise LensRefused(f"{name}: holds what is no number")
    return found


def _distortion(message: Any) -> tuple[DistortionModel, tuple[float, ...]]:
    numbers = tuple(_finite("d", message.d))
    if not any(abs(number) > ROUNDED for number in numbers):
        return "none", ()
    model = message.distortion_model
    if model not in COEFFICIENTS:
        raise LensRefused(f"distortion_model: '{model[:40]}' is none of {', '.join(COEFFICIENTS)}")
    if len(numbers) not in COEFFICIENTS[model]:
        wanted = " or ".join(map(str, COEFFICIENTS[model]))
        raise LensRefused(f"d: {len(numbers)} numbers, but {model} has {wanted}")
    return model, numbers
