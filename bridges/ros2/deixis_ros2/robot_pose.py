"""The robot's pose in the map, from geometry_msgs/PoseWithCovarianceStamped (as amcl publishes it). Pure."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

FARTHEST_M = 1e5
UNIT_WITHIN = 0.1
"""By how much the length of a quaternion may differ from 1: what a few digits do, and no more."""


class PoseRefused(ValueError):
    """A pose that cannot be used; the text names the field."""


class Pose(NamedTuple):
    """`base_link` in the map: metres, and degrees counter-clockwise from its x axis."""

    x_m: float
    y_m: float
    yaw_deg: float


def of_message(message: Any, map_frame: str) -> Pose:
    """Raises PoseRefused for another frame than the map's, or what is no pose."""
    if message.header.frame_id.lstrip("/") != map_frame.lstrip("/"):
        raise PoseRefused(f"header.frame_id: '{message.header.frame_id[:40]}' is not '{map_frame}' (setting map_frame)")
    position, turn = message.pose.pose.position, message.pose.pose.orientation
    numbers = [float(number) for number in (position.x, position.y, turn.x, turn.y, turn.z, turn.w)]
    if not all(map(math.isfinite, numbers)):
        raise PoseRefused("pose: holds what is no number")
    x, y, i, j, k, w = numbers
    if max(abs(x), abs(y)) > FARTHEST_M:
        raise PoseRefused(f"pose.position: ({x:g}, {y:g}) is more than {FARTHEST_M:g} m away")
    if abs(math.sqrt(i * i + j * j + k * k + w * w) - 1) > UNIT_WITHIN:
        raise PoseRefused("pose.orientation: not a quaternion of length 1")
    return Pose(x, y, math.degrees(math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))))
