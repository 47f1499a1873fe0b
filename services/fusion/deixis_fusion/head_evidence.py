"""The head as one frame shows it, and over a stroke: yaws by the median, as rays in the map."""

from __future__ import annotations

import math
from dataclasses import replace

from deixis_schemas.messages import HeadPose

from .evidence import SIDES, STATUSES, HeadObservation
from .frames import Flags, Frames
from .robust import majority, median, median_and_spread, median_angle

LEAST_HEAD_SHARE = 0.2


def head_now(pose: HeadPose | None) -> HeadObservation | None:
    """The head as one frame shows it."""
    if pose is None or pose.status not in ("tracking", "out_of_range"):
        return None
    if pose.status == "out_of_range":
        return HeadObservation(None, None, pose.side, beyond_deg=pose.beyond_deg)
    return HeadObservation(pose.yaw_deg, pose.yaw_sigma_deg, pose.side)


def head_over(frames: Frames, axis_deg: float | None = None) -> HeadObservation | None:
    """The head over a stroke; none where it was tracked in too few frames to tell.

    The yaw is from the direction `axis_deg` in the map, whichever way the camera was when it was seen; without it, from the
    direction to the camera in each frame.
    """
    total, status = float(frames.weights.sum()), frames.column("status")
    tracked, beyond = status == STATUSES.index("tracking"), status == STATUSES.index("out_of_range")
    tracked_share = float(frames.weights[tracked].sum()) / total if total else 0.0
    beyond_share = float(frames.weights[beyond].sum()) / total if total else 0.0
    if tracked_share + beyond_share < LEAST_HEAD_SHARE:
        return None
    if beyond_share > tracked_share:
        return _out_of_range(frames, beyond, beyond_share)
    weights = frames.weights[tracked]
    yaw, spread = median_angle((frames.column("yaw_deg") + frames.turns_to(axis_deg))[tracked], weights)
    stated = median(frames.column("yaw_sigma_deg")[tracked], weights)
    seen = HeadObservation(yaw, math.hypot(stated, spread), None, tracked_share)
    return _with_pitch(seen, frames, tracked)


def _with_pitch(seen: HeadObservation, frames: Frames, tracked: Flags) -> HeadObservation:
    """The same with the pitch, where it was told with its sigma in most frames."""
    told = tracked & frames.tells("pitch_deg")
    weights = frames.weights[told]
    if not told.any() or weights.sum() < frames.weights[tracked].sum() / 2:
        return seen
    pitch, spread = median_and_spread(frames.column("pitch_deg")[told], weights)
    stated = median(frames.column("pitch_sigma_deg")[told], weights)
    return replace(seen, pitch_deg=pitch, pitch_sigma_deg=math.hypot(stated, spread))


def _out_of_range(frames: Frames, beyond: Flags, share: float) -> HeadObservation:
    sided, told = beyond & frames.tells("side"), beyond & frames.tells("beyond_deg")
    side = majority(frames.column("side")[sided], frames.weights[sided])
    limit = median(frames.column("beyond_deg")[told], frames.weights[told]) if told.any() else None
    return HeadObservation(None, None, None if side is None else SIDES[side], share, limit)
