"""The head as one frame shows it, and over a stroke: yaws by the median, as rays in the map."""

from __future__ import annotations

import math

from deixis_schemas.messages import HeadPose

from .evidence import HeadObservation, Weighed
from .robust import majority, median, median_angle

LEAST_HEAD_SHARE = 0.2


def head_now(pose: HeadPose | None) -> HeadObservation | None:
    """The head as one frame shows it."""
    if pose is None or pose.status not in ("tracking", "out_of_range"):
        return None
    if pose.status == "out_of_range":
        return HeadObservation(None, None, pose.side, beyond_deg=pose.beyond_deg)
    return HeadObservation(pose.yaw_deg, pose.yaw_sigma_deg, pose.side)


def head_over(weighed: Weighed, axis_deg: float | None = None) -> HeadObservation | None:
    """The head over a stroke; none where it was tracked in too few frames to tell.

    The yaw is from the direction `axis_deg` in the map, whichever way the camera was when it was seen; without it, from the
    direction to the camera in each frame.
    """
    total = math.fsum(weight for _, weight in weighed)
    tracked = [(s, w) for s, w in weighed if s.pose is not None and s.pose.status == "tracking"]
    beyond = [(s.pose, w) for s, w in weighed if s.pose is not None and s.pose.status == "out_of_range"]
    tracked_share = math.fsum(weight for _, weight in tracked) / total if total else 0.0
    beyond_share = math.fsum(weight for _, weight in beyond) / total if total else 0.0
    if tracked_share + beyond_share < LEAST_HEAD_SHARE:
        return None
    if beyond_share > tracked_share:
        side = majority([(pose.side, weight) for pose, weight in beyond if pose.side is not None])
        told = [(pose.beyond_deg, weight) for pose, weight in beyond if pose.beyond_deg is not None]
        return HeadObservation(None, None, side, beyond_share, median(told) if told else None)
    yaw, spread = median_angle([((s.pose.yaw_deg or 0.0) + s.turn_to(axis_deg), w) for s, w in tracked if s.pose])
    stated = median([(s.pose.yaw_sigma_deg or 0.0, w) for s, w in tracked if s.pose])
    return HeadObservation(yaw, math.hypot(stated, spread), None, tracked_share)
