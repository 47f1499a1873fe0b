"""Truth of camera and robot, and the world that labels are in: that of the renderer, moved along Z to the first person."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .geometry import Floats, RobotState, View
from .pixels import rounded
from .scene import Scene

REFERENCE_X_M = 2.0
"""Map x of the labels' origin where there is no person."""


def labels_origin(scene: Scene) -> Floats:
    """Shift from the renderer's world to that of the labels (3,): the first person begins at z = 0."""
    x_m = scene.people[0].place_m[0] if scene.people else REFERENCE_X_M
    return np.array([0.0, 0.0, x_m])


def pose_truth(view: View, origin: Floats) -> dict[str, list[float]]:
    """x_camera = R x_labels + t."""
    translation = view.translation - view.rotation @ origin
    return {"R_world_to_cam": rounded(view.rotation.ravel(), 7), "t_world_to_cam": rounded(translation, 6)}


def camera_truth(scene: Scene, view: View, origin: Floats) -> dict[str, Any]:
    """Of `meta.camera`: the camera of this view, that of the first frame."""
    return {
        "K": [rounded(row, 4) for row in view.matrix],
        "dist": [0.0] * 5,
        **pose_truth(view, origin),
        "height_m": scene.camera.position_m[2],
        "pitch_up_deg": scene.camera.pitch_up_deg,
        "roll_deg": scene.camera.roll_deg,
        "note": "OpenCV pinhole, x right y down z forward, pixel centres at integers",
    }


def robot_truth(robot: RobotState) -> dict[str, float]:
    """Of a frame's `robot`: its pose in the map."""
    return {"x_m": round(robot.x_m, 4), "y_m": round(robot.y_m, 4), "yaw_deg": round(robot.yaw_deg, 3)}


def user_truth(head_centre: Floats, view: View, origin: Floats) -> dict[str, Any]:
    """Of `user_pos`: below the head, from the camera's foot; x along the horizontal part of the optical axis, y left."""
    ahead = view.rotation[2] * np.array([1.0, 0.0, 1.0])
    ahead /= np.linalg.norm(ahead)
    left = np.cross([0.0, 1.0, 0.0], ahead)
    offset = head_centre - view.centre
    return {
        "world": rounded((head_centre + origin) * np.array([1.0, 0.0, 1.0]), 3),
        "robot_xy": rounded((float(offset @ ahead), float(offset @ left)), 3),
        "distance_m": round(math.hypot(offset[0], offset[2]), 3),
    }
