"""Frames of the renderer, and the camera's view over time.

Map: as in the scene (x forward, y left, z up). World: X = -y (the picture's right for a camera that looks along x), Y = z (up),
Z = -x (toward the camera); the avatars stand upright in it and face +Z. Camera: OpenCV (x right, y down, z ahead), pixel
centres at integers. All metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .scene import Camera, Waypoint

Floats = NDArray[np.float64]

WORLD_OF_MAP: Floats = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
"""world = WORLD_OF_MAP @ map; its inverse is its transpose."""


def to_world(position_m: Sequence[float]) -> Floats:
    """A map position, 2 (on the floor) or 3 numbers, in the world."""
    world: Floats = WORLD_OF_MAP @ np.array([*position_m, 0.0][:3], float)
    return world


def world_turn_deg(heading_deg: float) -> float:
    """A map heading as a turn about the world's Y from +Z, positive toward +X: 0 faces a robot that looks along x."""
    return wrap_deg(heading_deg - 180.0)


def wrap_deg(angle_deg: float) -> float:
    """Into -180 (included) to 180."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def smooth_step(share: float) -> float:
    """Minimum-jerk way from 0 to 1 (Flash and Hogan 1985); clipped outside."""
    t = min(max(share, 0.0), 1.0)
    return t**3 * (10 - 15 * t + 6 * t * t)


@dataclass(frozen=True)
class RobotState:
    """Pose of the robot in the map."""

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_deg: float = 0.0


def robot_at(path: Sequence[Waypoint], time_s: float) -> RobotState:
    """Pose of the robot at a time; smooth between waypoints, yaw the short way round."""
    if not path:
        return RobotState()
    before = max((point for point in path if point.at_s <= time_s), key=lambda p: p.at_s, default=path[0])
    after = min((point for point in path if point.at_s > time_s), key=lambda p: p.at_s, default=path[-1])
    span = after.at_s - before.at_s
    share = smooth_step((time_s - before.at_s) / span) if span > 0 else 0.0
    turn = wrap_deg(after.yaw_deg - before.yaw_deg)
    return RobotState(
        before.x_m + share * (after.x_m - before.x_m),
        before.y_m + share * (after.y_m - before.y_m),
        before.yaw_deg + share * turn,
    )


@dataclass(frozen=True)
class View:
    """A pinhole camera somewhere: x_camera = rotation @ x_world + translation; matrix is K."""

    width: int
    height: int
    matrix: Floats
    rotation: Floats
    translation: Floats

    @property
    def centre(self) -> Floats:
        """Optical centre, world."""
        return -self.rotation.T @ self.translation

    def part(self, left: int, top: int, width: int, height: int) -> View:
        """The view through a window of the picture, pixels."""
        matrix = self.matrix.copy()
        matrix[0, 2] -= left
        matrix[1, 2] -= top
        return View(width, height, matrix, self.rotation, self.translation)

    def in_camera(self, points: Floats) -> Floats:
        """World points (..., 3) in camera axes."""
        return points @ self.rotation.T + self.translation

    def project(self, points: Floats) -> Floats:
        """World points (..., 3) to pixels (..., 2); meaningless behind the camera."""
        seen = self.in_camera(points) @ self.matrix.T
        pixels: Floats = seen[..., :2] / seen[..., 2:]
        return pixels


def view_at(camera: Camera, robot: RobotState) -> View:
    """What the camera sees when the robot is there."""
    yaw = math.radians(robot.yaw_deg)
    x, y, z = camera.position_m
    centre = np.array([robot.x_m + math.cos(yaw) * x - math.sin(yaw) * y, robot.y_m + math.sin(yaw) * x + math.cos(yaw) * y, z])
    # base_link -> camera body (x ahead, y left, z up): yaw to the left, pitch up, then roll clockwise seen from behind.
    body = Rotation.from_euler("ZYX", [robot.yaw_deg + camera.yaw_deg, -camera.pitch_up_deg, camera.roll_deg], degrees=True)
    optical_of_body = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    rotation = optical_of_body @ body.as_matrix().T @ WORLD_OF_MAP.T
    focal = camera.focal_px
    matrix = np.array([[focal, 0.0, (camera.width - 1) / 2], [0.0, focal, (camera.height - 1) / 2], [0.0, 0.0, 1.0]])
    return View(camera.width, camera.height, matrix, rotation, -rotation @ WORLD_OF_MAP @ centre)
