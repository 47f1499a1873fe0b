"""Where a person is in the map, and at which bearing the person sees a POI.

Frames by REP-103 and REP-105: optical x right, y down, z forward; `base_link` and map x forward, y left, z up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from deixis_schemas.messages import CameraInfo

Vector = tuple[float, float, float]

UNDISTORT_STEPS = 20


@dataclass(frozen=True)
class RobotPlace:
    """Pose of `base_link` in the map frame: metres, degrees counter-clockwise."""

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_deg: float = 0.0


@dataclass(frozen=True)
class HeadSighting:
    """A head in a picture: its centre, the size (width, height) of the picture, and its depth along the optical axis."""

    centre_px: tuple[float, float]
    image_size: tuple[int, int]
    depth_m: float


@dataclass(frozen=True)
class PersonPlace:
    """A person's head in the map, and the camera as the person sees it."""

    position_m: Vector
    camera_m: Vector
    distance_m: float
    sigma_m: float


def camera_in_map(info: CameraInfo, robot: RobotPlace) -> Vector:
    """Optical centre in the map frame, metres."""
    return _to_map(info.mount.position_m, robot)


def locate(info: CameraInfo, robot: RobotPlace, head: HeadSighting, sigma: float) -> PersonPlace:
    """Place in the map of a head as sighted; `sigma` is the relative standard deviation of its depth.

    Raises ValueError where `info` has no intrinsics.
    """
    x, y = viewing_ray(info, head.centre_px, head.image_size)
    camera = camera_in_map(info, robot)
    ray = (x * head.depth_m, y * head.depth_m, head.depth_m)
    position = _to_map(_add(info.mount.position_m, _to_base(ray, info)), robot)
    distance = math.dist(position, camera)
    return PersonPlace(position_m=position, camera_m=camera, distance_m=distance, sigma_m=distance * sigma)


def depth_of_face(info: CameraInfo, width_px: float, image_width: int, face_width_m: float) -> float:
    """Distance along the optical axis of a face `width_px` wide: f * face_width_m / width_px.

    Raises ValueError where `info` has no intrinsics or the face no width.
    """
    if width_px <= 0:
        raise ValueError("width_px: a face without width has no distance")
    return _focal_x(info, image_width) * face_width_m / width_px


def viewing_ray(info: CameraInfo, pixel: tuple[float, float], image_size: tuple[int, int]) -> tuple[float, float]:
    """Direction of a pixel in the optical frame as x/z, y/z, free of distortion.

    Raises ValueError where `info` has no intrinsics.
    """
    fx, _, cx, _, fy, cy, *_ = _matrix(info)
    # K belongs to the calibrated size: pixel centres are integers, so scaling is about -0.5.
    u = (pixel[0] + 0.5) * (info.width / image_size[0]) - 0.5 if info.width else pixel[0]
    v = (pixel[1] + 0.5) * (info.height / image_size[1]) - 0.5 if info.height else pixel[1]
    return _undistort(info, (u - cx) / fx, (v - cy) / fy)


def bearing_deg(place: PersonPlace, target_m: Vector) -> float:
    """Bearing of a point at the person: from the direction person -> camera, positive toward the image's right.

    That is counter-clockwise seen from above, the person's own left (REP-103); degrees within -180 and 180.
    """
    ax, ay = place.camera_m[0] - place.position_m[0], place.camera_m[1] - place.position_m[1]
    bx, by = target_m[0] - place.position_m[0], target_m[1] - place.position_m[1]
    return math.degrees(math.atan2(ax * by - ay * bx, ax * bx + ay * by))


def bearing_sigma_deg(place: PersonPlace, target_m: Vector, extent_m: float) -> float:
    """Standard deviation of that bearing from the person's distance and the POI's extent, degrees, at most 60.

    The person's place is uncertain along the line to the camera: that moves the bearing of what lies to the side.
    """
    away = max(math.dist(place.position_m[:2], target_m[:2]), 0.05)
    across = place.sigma_m * math.sin(math.radians(bearing_deg(place, target_m)))
    spread = math.hypot(across, extent_m / math.sqrt(12))
    return min(60.0, math.degrees(math.atan2(spread, away)))


class DistanceFilter:
    """Smooths one person's depth over time.

    A face that turns away shows another width (a profile is up to a fifth narrower or wider), so that depth follows slowly
    while the head is turned.
    """

    TURNED_SLOWDOWN = 8.0

    def __init__(self, time_constant_s: float) -> None:
        self._time_constant_s = time_constant_s
        self._log_depth: float | None = None

    def update(self, depth_m: float, elapsed_s: float, frontal: bool) -> float:
        """Take in one measured depth, `elapsed_s` after the last; returns the smoothed one, metres."""
        measured = math.log(depth_m)
        if self._log_depth is None:
            self._log_depth = measured
            return depth_m
        constant = self._time_constant_s * (1.0 if frontal else self.TURNED_SLOWDOWN)
        share = 1.0 if constant <= 0 else 1 - math.exp(-max(0.0, elapsed_s) / constant)
        self._log_depth += share * (measured - self._log_depth)
        return math.exp(self._log_depth)


def _matrix(info: CameraInfo) -> tuple[float, ...]:
    if info.camera_matrix is None:
        raise ValueError("camera_matrix: the camera has no intrinsics yet")
    return info.camera_matrix


def _focal_x(info: CameraInfo, image_width: int) -> float:
    scale = image_width / info.width if info.width else 1.0
    return _matrix(info)[0] * scale


def _to_base(optical: Vector, info: CameraInfo) -> Vector:
    """A direction in the optical frame turned into `base_link`."""
    forward, left, up = optical[2], -optical[0], -optical[1]
    pitch, yaw = math.radians(info.mount.pitch_up_deg), math.radians(info.mount.yaw_deg)
    ahead = forward * math.cos(pitch) - up * math.sin(pitch)
    z = forward * math.sin(pitch) + up * math.cos(pitch)
    return ahead * math.cos(yaw) - left * math.sin(yaw), ahead * math.sin(yaw) + left * math.cos(yaw), z


def _to_map(base: Vector, robot: RobotPlace) -> Vector:
    cos, sin = math.cos(math.radians(robot.yaw_deg)), math.sin(math.radians(robot.yaw_deg))
    return robot.x_m + base[0] * cos - base[1] * sin, robot.y_m + base[0] * sin + base[1] * cos, base[2]


def _add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _undistort(info: CameraInfo, x: float, y: float) -> tuple[float, float]:
    if info.distortion_model == "none" or not any(info.distortion):
        return x, y
    if info.distortion_model == "equidistant":
        return _undistort_equidistant(info.distortion, x, y)
    return _undistort_brown(info.distortion, x, y)


def _undistort_brown(coefficients: list[float], x: float, y: float) -> tuple[float, float]:
    """Inverse of OpenCV's plumb-bob and rational models by fixed-point steps."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (coefficients + [0.0] * 8)[:8]
    u, v = x, y
    for _ in range(UNDISTORT_STEPS):
        r2 = u * u + v * v
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        if abs(radial) < 1e-6:
            return x, y
        tangential_x = 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
        tangential_y = p1 * (r2 + 2 * v * v) + 2 * p2 * u * v
        u, v = (x - tangential_x) / radial, (y - tangential_y) / radial
    # Outside the range that the coefficients describe the steps run away: then the pixel as it is serves better.
    return (u, v) if math.isfinite(u) and math.isfinite(v) and math.hypot(u, v) < 10 else (x, y)


def _undistort_equidistant(coefficients: list[float], x: float, y: float) -> tuple[float, float]:
    """Inverse of the Kannala-Brandt fisheye model."""
    k1, k2, k3, k4 = (coefficients + [0.0] * 4)[:4]
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
