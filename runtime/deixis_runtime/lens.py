"""How a camera projects, as `camera/info` says: pixels to directions and back to a local pinhole. Free of OpenCV.

`cv2.undistortPoints` does the same at 45 MB of memory, in stages that need OpenCV for nothing else; a test compares the two.
Optical axes by REP-103: x right, y down, z forward. Pixel coordinates have their origin at the centre of the top left pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from deixis_schemas.messages import CameraInfo

Point = tuple[float, float]
Size = tuple[int, int]
Row = tuple[float, float, float]
Square = tuple[Row, Row, Row]
DistortionModel = Literal["none", "plumb_bob", "rational_polynomial", "equidistant"]
Matrix = tuple[float, float, float, float, float, float, float, float, float]

UNDISTORT_STEPS = 20
FIELD_LIMITS_DEG = (5.0, 170.0)
"""Width of view by fx. Below, a face 5 m away is 40 % of the picture wide and no arm fits in; above, an angle at the rim takes
over 130 times the pixels that it takes in the middle. A fisheye of 180 degrees has 115 by this measure."""
PIXEL_LIMITS = (0.4, 2.5)
"""fx by fy: pixels are square, or as in half frames of video up to twice as wide or high."""
ASPECT_TOLERANCE = 0.02
"""Scaling to whole pixels changes the ratio of a small picture by about 1 %."""


class LensError(ValueError):
    """A camera whose projection is not known."""


class Pinhole(NamedTuple):
    """A pinhole camera: focal length and principal point, pixels."""

    focal_px: float
    centre_x_px: float
    centre_y_px: float


@dataclass(frozen=True)
class Lens:
    """Intrinsics for pictures of `width` x `height`, and their use for any size of the same aspect ratio.

    matrix: fx, fy, cx, cy in pixels. distortion: coefficients in OpenCV's order, 4 to 14 of them by `model`.
    """

    width: int
    height: int
    matrix: tuple[float, float, float, float]
    model: str = "none"
    distortion: tuple[float, ...] = ()

    @staticmethod
    def of(info: CameraInfo) -> Lens:
        """The lens that the camera tells of. Raises LensError where it has no intrinsics yet, or none that can be."""
        if info.camera_matrix is None:
            raise LensError("camera_matrix: the camera has no intrinsics yet")
        check_matrix(info.camera_matrix, info.width, info.height)
        fx, _, cx, _, fy, cy, *_ = info.camera_matrix
        model = info.distortion_model if any(info.distortion) else "none"
        return Lens(info.width, info.height, (fx, fy, cx, cy), model, tuple(info.distortion))

    @staticmethod
    def assumed(width: int, height: int, horizontal_fov_deg: float) -> Lens:
        """A pinhole with square pixels and its axis through the middle of the picture."""
        focal = width / 2 / math.tan(math.radians(horizontal_fov_deg) / 2)
        return Lens(width, height, (focal, focal, (width - 1) / 2, (height - 1) / 2))

    def fits(self, width: int, height: int) -> bool:
        """Whether pictures of that size have its aspect ratio. Others were cut, and nobody knows where."""
        return same_aspect((self.width, self.height), (width, height))

    def focal_x_px(self, size: Size) -> float:
        """Focal length along x in a picture of that size (width, height)."""
        return self.matrix[0] * size[0] / self.width

    def ray(self, pixel: Point, size: Size) -> Point:
        """Direction of a pixel of a picture of that size as x/z, y/z, free of distortion."""
        fx, fy, cx, cy = self.matrix
        # Pixel centres are integers, so scaling is about -0.5.
        u = (pixel[0] + 0.5) * (self.width / size[0]) - 0.5
        v = (pixel[1] + 0.5) * (self.height / size[1]) - 0.5
        return self._undistort((u - cx) / fx, (v - cy) / fy)

    def pinhole_at(self, pixel: Point, size: Size) -> Pinhole:
        """The pinhole camera that the lens is in the neighbourhood of a pixel: what a small object there is seen through."""
        x, y = self.ray(pixel, size)
        right, down = self.ray((pixel[0] + 1, pixel[1]), size), self.ray((pixel[0], pixel[1] + 1), size)
        area = (right[0] - x) * (down[1] - y) - (right[1] - y) * (down[0] - x)
        focal = 1 / math.sqrt(max(abs(area), 1e-12))
        return Pinhole(focal, pixel[0] - focal * x, pixel[1] - focal * y)

    def _undistort(self, x: float, y: float) -> Point:
        if self.model == "none":
            return x, y
        if self.model == "equidistant":
            return _undistort_equidistant(self.distortion, x, y)
        return _undistort_brown(self.distortion, x, y)


def check_matrix(matrix: Matrix, width: int, height: int) -> None:
    """Raises LensError, with the field and the cause, for a K that no camera has whose pictures have that size."""
    fx, _, cx, skewed, fy, cy, *last = matrix
    if not (width and height):
        raise LensError(f"camera_matrix: it is for pictures of {width} x {height} pixels")
    if fx <= 0 or fy <= 0:
        raise LensError(f"camera_matrix: focal lengths {fx:g} and {fy:g} are not positive (an uncalibrated camera?)")
    if skewed != 0 or last != [0, 0, 1]:
        raise LensError("camera_matrix: rows are not [fx, s, cx], [0, fy, cy], [0, 0, 1]")
    field_deg = 2 * math.degrees(math.atan(width / 2 / fx))
    if not FIELD_LIMITS_DEG[0] <= round(field_deg, 6) <= FIELD_LIMITS_DEG[1]:
        raise LensError(
            f"camera_matrix: a focal length of {fx:.4g} pixels is a view {field_deg:.5g} degrees wide; "
            f"{FIELD_LIMITS_DEG[0]:g} to {FIELD_LIMITS_DEG[1]:g} can be"
        )
    if not PIXEL_LIMITS[0] <= fx / fy <= PIXEL_LIMITS[1]:
        raise LensError(f"camera_matrix: focal lengths {fx:.4g} and {fy:.4g} are too far apart for one lens")
    if not (-width <= cx <= 2 * width and -height <= cy <= 2 * height):
        raise LensError(f"camera_matrix: principal point ({cx:g}, {cy:g}) lies far outside the picture")


def same_aspect(one: Size, other: Size) -> bool:
    """Whether pictures of two sizes have the same shape."""
    return abs(other[0] * one[1] / (one[0] * other[1]) - 1) <= ASPECT_TOLERANCE


def _undistort_brown(given: tuple[float, ...], x: float, y: float) -> Point:
    """Inverse of OpenCV's model with up to 14 coefficients by fixed-point steps: radial, tangential, thin prism, tilt."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tilt_x, tilt_y = (given + (0.0,) * 14)[:14]
    if tilt_x or tilt_y:
        x, y = _untilted(tilt_x, tilt_y, x, y)
    u, v = x, y
    for _ in range(UNDISTORT_STEPS):
        r2 = u * u + v * v
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        if abs(radial) < 1e-6:
            return x, y
        shift_x = 2 * p1 * u * v + p2 * (r2 + 2 * u * u) + r2 * (s1 + s2 * r2)
        shift_y = p1 * (r2 + 2 * v * v) + 2 * p2 * u * v + r2 * (s3 + s4 * r2)
        u, v = (x - shift_x) / radial, (y - shift_y) / radial
    # Outside the range that the coefficients describe the steps run away: then the pixel as it is serves better.
    return (u, v) if math.isfinite(u) and math.isfinite(v) and math.hypot(u, v) < 10 else (x, y)


def _untilted(tilt_x: float, tilt_y: float, x: float, y: float) -> Point:
    """The point on the sensor as it would be without the sensor's tilt about x and y, radians (OpenCV's tilted model)."""
    cos_x, sin_x, cos_y, sin_y = math.cos(tilt_x), math.sin(tilt_x), math.cos(tilt_y), math.sin(tilt_y)
    turn: Square = (
        (cos_y, sin_y * sin_x, -sin_y * cos_x),
        (0.0, cos_x, sin_x),
        (sin_y, -cos_y * sin_x, cos_y * cos_x),
    )
    depth = turn[2][2]
    flat = ((x + turn[0][2]) / depth, (y + turn[1][2]) / depth, 1.0)
    a, b, c = (sum(turn[row][column] * flat[row] for row in range(3)) for column in range(3))
    return a / c, b / c


def _undistort_equidistant(given: tuple[float, ...], x: float, y: float) -> Point:
    """Inverse of the Kannala-Brandt fisheye model."""
    k1, k2, k3, k4 = (given + (0.0,) * 4)[:4]
    distorted = math.hypot(x, y)
    if distorted < 1e-9:
        return x, y
    angle = distorted
    for _ in range(UNDISTORT_STEPS):
        a2 = angle * angle
        angle = distorted / (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
    angle = min(max(angle, 0.0), math.radians(89))
    scale = math.tan(angle) / distorted
    return x * scale, y * scale
