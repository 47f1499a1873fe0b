"""How a labelled camera is mounted and how it moves, from its R and t alone.

The robot of a labelled clip is the camera's foot: `base_link` lies on the floor below the optical centre and looks where the
horizontal part of the optical axis does. The map is `base_link` in frame 0. So a camera that moves is a robot that moves, and
its mount stays the same: height, pitch and roll.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from deixis_schemas.messages import CameraMount
from numpy.typing import NDArray

from .clips import ClipError, TrueView, Truth, Vector

Floats = NDArray[np.float64]

UP: Floats = np.array([0.0, 1.0, 0.0])
# The robot has no tilt: a camera that pitches, rolls or rises by more than this while it moves cannot be told of.
MAX_TILT_DEG = 0.5
MAX_RISE_M = 0.02


@dataclass(frozen=True)
class FootPose:
    """Where the camera's foot is in the map: metres, degrees counter-clockwise from the map's x axis."""

    x_m: float
    y_m: float
    yaw_deg: float


def mount_of(view: TrueView) -> CameraMount:
    """Height, pitch and roll of the camera over its foot (conventions of CameraMount)."""
    right, down, ahead = view.rotation
    pitch = math.asin(max(-1.0, min(1.0, float(ahead[1]))))
    roll = math.atan2(-float(right[1]), -float(down[1]))
    return CameraMount(
        position_m=(0.0, 0.0, round(float(view.centre[1]), 6)),
        pitch_up_deg=round(math.degrees(pitch), 6),
        roll_deg=round(math.degrees(roll), 6),
    )


def map_position(view: TrueView, world: Vector | Floats) -> tuple[float, float, float]:
    """A world point in the map of a camera: x forward and y left from its foot, z up (REP-103), metres."""
    ahead, left = _directions(view)
    offset = np.array(world) - view.centre
    return float(offset @ ahead), float(offset @ left), float(world[1])


def path_of(truth: Truth) -> list[FootPose]:
    """Where the camera's foot is in each frame; empty for a camera that stands. Raises ClipError for one that tilts."""
    start, mount = truth.meta.camera, mount_of(truth.meta.camera)
    path = []
    for frame in truth.frames:
        if frame.camera is not None:
            _refuse_tilt(frame.frame, mount, mount_of(frame.camera))
            path.append(_foot_pose(start, frame.camera))
    return path


def _foot_pose(start: TrueView, now: TrueView) -> FootPose:
    x, y, _ = map_position(start, now.centre)
    (ahead, left), (ahead_now, _) = _directions(start), _directions(now)
    return FootPose(x, y, math.degrees(math.atan2(float(ahead_now @ left), float(ahead_now @ ahead))))


def _directions(view: TrueView) -> tuple[Floats, Floats]:
    """Ahead and left of the camera's foot, world: the horizontal part of the optical axis; world and map share the vertical."""
    ahead = np.array([view.rotation[2, 0], 0.0, view.rotation[2, 2]])
    ahead /= np.linalg.norm(ahead)
    return ahead, np.cross(UP, ahead)


def _refuse_tilt(frame: int, mount: CameraMount, now: CameraMount) -> None:
    tilt = max(abs(now.pitch_up_deg - mount.pitch_up_deg), abs(now.roll_deg - mount.roll_deg))
    rise = abs(now.position_m[2] - mount.position_m[2])
    if tilt > MAX_TILT_DEG or rise > MAX_RISE_M:
        raise ClipError(
            f"frames.{frame}.camera: tilted by {tilt:.2f} degrees and raised by {rise:.3f} m against meta.camera; "
            "the camera of a robot on a floor only turns and drives"
        )
