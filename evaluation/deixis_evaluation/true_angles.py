"""Pitch and roll of a true head, in the convention in which headpose states its angles: relative to the line to the camera."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from deixis_headpose.head import Pose

from .clips import TrueHead

MIRROR = np.diag([1.0, -1.0, -1.0])
"""Between the axes of R_cam (x to the picture's right, y up, z toward the camera) and the camera's (right, down, ahead)."""


class TrueAngles(NamedTuple):
    """Yaw toward the picture's right, pitch up, roll of the crown toward the picture's right: degrees, 0 to the camera.

    Yaw is the labels' own, about the vertical of the world. Pitch and roll are about the axes of the camera as the stage sees
    them, which knows nothing of a tilt of its mount; none where the labels have no rotation.
    """

    yaw: float
    pitch: float | None = None
    roll: float | None = None


def true_angles(head: TrueHead) -> TrueAngles:
    """The angles of a head."""
    if head.R_cam is None or head.center_cam is None:
        return TrueAngles(head.yaw_rel_deg)
    _, pitch, roll = pose_of_truth(head.R_cam, head.center_cam).angles_deg()
    return TrueAngles(head.yaw_rel_deg, pitch, roll)


def pose_of_truth(rotation: list[float], centre_m: tuple[float, float, float]) -> Pose:
    """The pose as headpose has it. rotation: R_cam, row-major. centre_m: of the head in camera axes, metres."""
    in_camera = MIRROR @ np.array(rotation, np.float64).reshape(3, 3) @ MIRROR
    return Pose(np.asarray(in_camera, np.float64), np.array(centre_m, np.float64))
