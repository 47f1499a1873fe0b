"""Cameras of labelled clips, made up for tests."""

from typing import Any

import numpy as np

STANDING = {
    "K": [[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]],
    "R_world_to_cam": [1, 0, 0, 0, -1, 0, 0, 0, -1],
    "t_world_to_cam": [0, 1.3, 2],
}
"""A level camera 1.3 m high, 2 m before the world's origin."""


def turned_view(yaw_deg: float, pitch_up_deg: float, roll_deg: float, centre: tuple[float, float, float]) -> dict[str, Any]:
    """R and t of a camera turned to its left, up, and clockwise as seen from behind; at zero it looks along the world's -z."""
    yaw, pitch, roll = np.radians([yaw_deg, pitch_up_deg, roll_deg])
    ahead = np.array([-np.sin(yaw) * np.cos(pitch), np.sin(pitch), -np.cos(yaw) * np.cos(pitch)])
    level = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
    below = np.cross(ahead, level)
    right = np.cos(roll) * level + np.sin(roll) * below
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    return {"R_world_to_cam": rotation.ravel().tolist(), "t_world_to_cam": (-rotation @ np.array(centre)).tolist()}
