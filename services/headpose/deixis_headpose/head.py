"""The head as a textured ellipsoid in front of a pinhole camera: surface points, poses, projection, yaw.

Goes further than the sphere of eqs 5-9 (Pateraki et al. 2011): a sphere read twice as wrong beyond 60 degrees.

Axes are the camera's (x right, y down, z forward, metres). The head's own axes coincide with them for a head that faces
along the optical axis: the nose is at -z, the person's left ear at +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from deixis_runtime.lens import Pinhole
from numpy.typing import NDArray

Array = NDArray[np.float64]

NOSE = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True)
class Pose:
    """Rotation (3, 3) of head axes to camera axes and head centre (3,) in camera axes, metres."""

    rotation: Array
    position_m: Array

    def moved(self, step: Array) -> Pose:
        """The pose after a small step (6,): rotation vector about the head's centre in camera axes (rad), shift (m)."""
        turn, _ = cv2.Rodrigues(step[:3])
        return Pose(turn @ self.rotation, self.position_m + step[3:])

    def step_from(self, other: Pose) -> Array:
        """The step (6,) for which `other.moved(step)` is this pose."""
        matrix = self.rotation @ other.rotation.T
        turn = cv2.Rodrigues(matrix)[0].ravel()
        if not turn.any():
            # OpenCV takes a turn below 1e-5 rad for none; so small a one is the matrix's skew part.
            skew = matrix - matrix.T
            turn = 0.5 * np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        return np.concatenate([turn, self.position_m - other.position_m])

    def seen(self) -> Array:
        """Rotation (3, 3) relative to the line head -> camera; identity for a head that looks into the camera."""
        return facing_camera(self.position_m).T @ self.rotation

    def angles_deg(self) -> tuple[float, float, float]:
        """Yaw (toward image right), pitch (up), roll (crown to image right) relative to the line head -> camera, degrees."""
        seen = self.seen()
        nose = seen @ NOSE
        yaw = math.atan2(nose[0], -nose[2])
        pitch = math.asin(min(max(-nose[1], -1.0), 1.0))
        crown = (rotation_of(yaw, pitch).T @ seen) @ np.array([0.0, -1.0, 0.0])
        roll = math.atan2(crown[0], -crown[1])
        return math.degrees(yaw), math.degrees(pitch), math.degrees(roll)


def angle_between(one: Array, other: Array) -> float:
    """Angle of the rotation that leads from one rotation (3, 3) to another, degrees."""
    cosine = (float(np.vdot(one, other)) - 1) / 2
    return math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))


def rotation_of(yaw: float, pitch: float, roll: float = 0.0) -> Array:
    """Rotation (3, 3) that turns the nose by `yaw` to image right, then `pitch` up; crown by `roll` to image right. Radians."""
    cos_y, sin_y, cos_p, sin_p = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    cos_r, sin_r = math.cos(roll), math.sin(roll)
    about_y = np.array([[cos_y, 0, -sin_y], [0, 1, 0], [sin_y, 0, cos_y]])
    about_x = np.array([[1, 0, 0], [0, cos_p, sin_p], [0, -sin_p, cos_p]])
    about_z = np.array([[cos_r, -sin_r, 0], [sin_r, cos_r, 0], [0, 0, 1]])
    return np.asarray(about_y @ about_x @ about_z, dtype=np.float64)


def facing_camera(position_m: Array) -> Array:
    """Rotation (3, 3) of a head at `position_m` that looks straight into the camera, crown up."""
    x, y, z = (float(v) for v in position_m)
    return rotation_of(math.atan2(-x, z), math.atan2(y, math.hypot(x, z)))


@dataclass(frozen=True)
class Surface:
    """Points (N, 3) spread evenly over the ellipsoid, in head axes (metres), and their outward normals (N, 3)."""

    points_m: Array
    normals: Array


def ellipsoid(semi_axes_m: tuple[float, float, float], count: int, highest: float, lowest: float) -> Surface:
    """Spread `count` points by a golden spiral and keep those between two heights, given in semi-axes (-1 crown, 1 chin)."""
    axes = np.asarray(semi_axes_m)
    index = np.arange(count) + 0.5
    height = 2 * index / count - 1
    azimuth = np.pi * (1 + 5**0.5) * index
    radius = np.sqrt(1 - height**2)
    unit = np.stack([radius * np.cos(azimuth), height, radius * np.sin(azimuth)], axis=1)
    unit = unit[(height >= highest) & (height <= lowest)]
    normals = unit / axes
    return Surface(unit * axes, normals / np.linalg.norm(normals, axis=1, keepdims=True))


class Projection(NamedTuple):
    """Where the surface points of a posed head appear that face the camera."""

    points: NDArray[np.intp]
    """(M,) which points of the surface; all arrays below speak of these."""
    pixels: Array
    """(M, 2) in the picture."""
    facing: Array
    """(M,) cosine between normal and line of sight."""
    offsets: Array
    """(M, 3) from the head's centre, camera axes, metres."""
    rays: Array
    """(M, 3) line of sight: x / z, y / z, 1."""
    px_per_m: Array
    """(M,) size of a metre at the point."""

    def by_pose(self, gradients: Array) -> Array:
        """Derivative (M, 6) of a function of the picture by a step of the pose (rotation vector, shift).

        gradients: (M, 2), of the function by the pixel. A shift moves the point itself, a turn w by w x offset.
        """
        by_shift = np.empty_like(self.offsets)
        by_shift[:, :2] = gradients * self.px_per_m[:, None]
        by_shift[:, 2] = -(by_shift[:, 0] * self.rays[:, 0] + by_shift[:, 1] * self.rays[:, 1])
        (x, y, z), (a, b, c) = self.offsets.T, by_shift.T
        return np.stack([y * c - z * b, z * a - x * c, x * b - y * a, a, b, c], axis=1)


def project(surface: Surface, pose: Pose, camera: Pinhole, least_facing: float = 0.0) -> Projection:
    """Project the points of a posed head whose normals face the camera by a cosine above `least_facing`."""
    place, normals = pose.position_m, surface.normals @ pose.rotation.T
    offsets = surface.points_m @ pose.rotation.T
    at = offsets + place
    distance = np.sqrt(np.einsum("ij,ij->i", at, at))
    facing = -np.einsum("ij,ij->i", normals, at) / distance
    points = np.flatnonzero((facing > least_facing) & (at[:, 2] > 0.05))
    at = at[points]
    rays = at / at[:, 2:]
    pixels = camera.focal_px * rays[:, :2] + (camera.centre_x_px, camera.centre_y_px)
    return Projection(points, pixels, facing[points], offsets[points], rays, camera.focal_px / at[:, 2])
