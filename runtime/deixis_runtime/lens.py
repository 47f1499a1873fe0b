"""How a camera projects, as `camera/info` says: pixels to directions and back to a local pinhole. Free of OpenCV.

`cv2.undistortPoints` does the same at 45 MB of memory, in stages that need OpenCV for nothing else; a test compares the two.
Optical axes by REP-103: x right, y down, z forward. Pixel coordinates have their origin at the centre of the top left pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from deixis_schemas.messages import CameraInfo

Point = tuple[float, float]
Size = tuple[int, int]
Row = tuple[float, float, float]
Square = tuple[Row, Row, Row]

UNDISTORT_STEPS = 20
FOCAL_LIMITS_PX = (1.0, 1e6)
OFF_PICTURE = 10
"""So many pictures away the axis of a lens may be, where the picture was cut out of a larger one."""


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
        if info.camera_matrix is None or not (info.width and info.height):
            raise LensError("camera_matrix: the camera has no intrinsics yet")
        fx, _, cx, _, fy, cy, *_ = info.camera_matrix
        if not all(FOCAL_LIMITS_PX[0] <= focal <= FOCAL_LIMITS_PX[1] for focal in (fx, fy)):
            raise LensError(f"camera_matrix: focal lengths of {fx:.3g} and {fy:.3g} pixels")
        if abs(cx) > OFF_PICTURE * info.width or abs(cy) > OFF_PICTURE * info.height:
            raise LensError(f"camera_matrix: principal point at {cx:.3g}, {cy:.3g} of {info.width} x {info.height} pixels")
        model = info.distortion_model if any(info.distortion) else "none"
        return Lens(info.width, info.height, (fx, fy, cx, cy), model, tuple(info.distortion))

    @staticmethod
    def assumed(width: int, height: int, horizontal_fov_deg: float) -> Lens:
        """A pinhole with square pixels and its axis through the middle of the picture."""
        focal = width / 2 / math.tan(math.radians(horizontal_fov_deg) / 2)
        return Lens(width, height, (focal, focal, (width - 1) / 2, (height - 1) / 2))

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
