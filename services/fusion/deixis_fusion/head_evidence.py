"""The head as one frame shows it, and over a stroke: yaws by the median, as rays in the map."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from deixis_schemas.messages import HeadPose

from .evidence import TURNED, HeadObservation
from .frames import ROUNDING, Frames, Values
from .robust import Middle, medians

LEAST_HEAD_SHARE = 0.2


def head_now(pose: HeadPose | None) -> HeadObservation | None:
    """The head as one frame shows it."""
    if pose is None or pose.status not in ("tracking", "out_of_range"):
        return None
    if pose.status == "out_of_range":
        return HeadObservation(None, None, pose.side, beyond_deg=pose.beyond_deg)
    return HeadObservation(pose.yaw_deg, pose.yaw_sigma_deg, pose.side)


class HeadFrames:
    """The frames of a stroke that show the head within its range, or beyond it, and what these measured (4, n): `evidence.ROW`.

    `measured` becomes not a number in the other frames. `turns_deg` (n) is added to the yaws of each.
    """

    def __init__(self, frames: Frames, totals: Mapping[str, float], measured: Values, turns_deg: Values) -> None:
        self._frames = frames
        total = frames.weight
        self._tracked = totals["tracking"] / total if total else 0.0
        self._beyond = totals["out_of_range"] / total if total else 0.0
        if totals["tracking"] != totals["frame"]:
            tracking = frames.show("tracking")
            measured[:, ~tracking] = np.nan
            totals = frames.totals(frames.weights * tracking)
        self._has_pitch = totals["has_pitch"] >= totals["tracking"] / 2 - ROUNDING
        measured[0] += turns_deg

    def observed(self, middle: Middle) -> HeadObservation | None:
        """What they show together; none where the head was tracked in too few frames to tell."""
        if self._tracked + self._beyond < LEAST_HEAD_SHARE - ROUNDING:
            return None
        if self._beyond > self._tracked + ROUNDING:
            return _out_of_range(self._frames, self._beyond)
        yaw, sigma, pitch, pitch_sigma = middle
        if not self._has_pitch:
            pitch = pitch_sigma = None
        return HeadObservation(yaw, sigma, None, self._tracked, None, pitch, pitch_sigma)


def _out_of_range(frames: Frames, share: float) -> HeadObservation:
    weights = frames.weights * frames.column("out_of_range")
    (limit,) = medians(np.where(weights > 0, frames.column("beyond_deg"), np.nan)[None], frames.early)
    side = frames.side_of(TURNED, frames.totals(weights), weights)
    return HeadObservation(None, None, side, share, None if math.isnan(limit) else limit)
