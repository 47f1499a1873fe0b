"""The head as a textured ellipsoid in front of a pinhole camera: surface points, poses, projection, yaw.

Goes further than the sphere of eqs 5-9 (Pateraki et al. 2011): a sphere read twice as wrong beyond 60 degrees.

Axes are the camera's (x right, y down, z forward, metres). The head's own axes coincide with them for a head that faces
along the optical axis: the nose is at -z, the person's left ear at +x.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NOSE = np.array([0.0, 0.0, -1.0])


class Camera(NamedTuple):
    """Pinhole camera: focal length and principal point in pixels."""

    focal_px: float
    centre_x_px: float
    centre_y_px: float


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
        turn, _ = cv2.Rodrigues(self.rotation @ other.rotation.T)
        return np.concatenate([turn.ravel(), self.position_m - other.position_m])

    def angle_to(self, other: Pose) -> float:
        """Angle of the rotation between the two poses as each is seen from the camera, degrees."""
        between = self.seen().T @ other.seen()
        return float(np.degrees(np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1))))

    def seen(self) -> Array:
        """Rotation (3, 3) relative to the line head -> camera; identity for a head that looks into the camera."""
        return facing_camera(self.position_m).T @ self.rotation

    def angles_deg(self) -> tuple[float, float, float]:
        """Yaw (toward image right), pitch (up), roll (crown to image right) relative to the line head -> camera, degrees."""
        seen = self.seen()
        nose = seen @ NOSE
        yaw = np.arctan2(nose[0], -nose[2])
        pitch = np.arcsin(np.clip(-nose[1], -1, 1))
        crown = (rotation_of(yaw, pitch).T @ seen) @ np.array([0.0, -1.0, 0.0])
        roll = np.arctan2(crown[0], -crown[1])
        return float(np.degrees(yaw)), float(np.degrees(pitch)), float(np.degrees(roll))


def rotation_of(yaw: float, pitch: float, roll: float = 0.0) -> Array:
    """Rotation (3, 3) that turns the nose by `yaw` to image right, then `pitch` up; crown by `roll` to image right. Radians."""
    cos_y, sin_y, cos_p, sin_p, cos_r, sin_r = (
        np.cos(yaw),
        np.sin(yaw),
        np.cos(pitch),
        np.sin(pitch),
        np.cos(roll),
        np.sin(roll),
    )
    about_y = np.array([[cos_y, 0, -sin_y], [0, 1, 0], [sin_y, 0, cos_y]])
    about_x = np.array([[1, 0, 0], [0, cos_p, sin_p], [0, -sin_p, cos_p]])
    about_z = np.array([[cos_r, -sin_r, 0], [sin_r, cos_r, 0], [0, 0, 1]])
    return np.asarray(about_y @ about_x @ about_z, dtype=np.float64)


def facing_camera(position_m: Array) -> Array:
    """Rotation (3, 3) of a head at `position_m` that looks straight into the camera, crown up."""
    toward = -position_m / np.linalg.norm(position_m)
    return rotation_of(float(np.arctan2(toward[0], -toward[2])), float(np.arcsin(np.clip(-toward[1], -1, 1))))


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
    """Where the surface points of a posed head appear."""

    pixels: Array
    """(N, 2) in the picture."""
    facing: Array
    """(N,) cosine between normal and line of sight; negative on the far side."""
    jacobian: Array
    """(N, 2, 6) of the pixels by a step of the pose (rotation vector, shift)."""


def project(surface: Surface, pose: Pose, camera: Camera) -> Projection:
    """Project all surface points of a posed head. Points must lie before the camera; others give facing -1."""
    offset = surface.points_m @ pose.rotation.T
    x, y, z = (offset + pose.position_m).T
    z = np.maximum(z, 0.05)
    u, v = x / z, y / z
    pixels = np.stack([camera.focal_px * u + camera.centre_x_px, camera.focal_px * v + camera.centre_y_px], axis=1)
    normals = surface.normals @ pose.rotation.T
    sight = np.stack([u, v, np.ones_like(u)], axis=1)
    facing = -np.einsum("ij,ij->i", normals, sight) / np.linalg.norm(sight, axis=1)
    k = camera.focal_px / z
    dx, dy, dz = offset.T
    jacobian = np.empty((len(z), 2, 6))
    jacobian[:, 0, 3], jacobian[:, 0, 4], jacobian[:, 0, 5] = k, 0.0, -k * u
    jacobian[:, 1, 3], jacobian[:, 1, 4], jacobian[:, 1, 5] = 0.0, k, -k * v
    # d(w x offset)/dw: a turn about x moves a point by (0, -dz, dy), about y by (dz, 0, -dx), about z by (-dy, dx, 0).
    jacobian[:, 0, 0], jacobian[:, 0, 1], jacobian[:, 0, 2] = -k * u * dy, k * (dz + u * dx), -k * dy
    jacobian[:, 1, 0], jacobian[:, 1, 1], jacobian[:, 1, 2] = -k * (dz + v * dy), k * v * dx, k * dx
    return Projection(pixels, facing, jacobian)
