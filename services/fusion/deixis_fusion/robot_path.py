"""Where the robot was when a frame was captured: the poses of the last seconds, interpolated."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from typing import NamedTuple

from deixis_schemas.messages import RobotPose

from .localisation import RobotPlace, wrapped_deg

KEPT_S = 5.0
# Poses further apart are words of a robot that publishes on change: it stood at the first until it came to the second.
MAX_GAP_S = 1.0
# After this, a silent robot is taken to stand where it said last, not where its last speed would have carried it.
EXTRAPOLATED_S = 0.2
# Speed from poses closer together would be their noise.
BASELINE_S = 0.05


class RobotFix(NamedTuple):
    """Where the robot was at one time, and in `doubt` why that may be wrong; empty where nothing speaks against it."""

    place: RobotPlace
    doubt: str = ""


class RobotPath:
    """Poses by their stamps. One that is more than `max_age_s` older than a frame is used for it, and doubted."""

    def __init__(self, max_age_s: float) -> None:
        self._max_age_s = max_age_s
        self._start = RobotPlace()
        self._poses: deque[RobotPose] = deque()

    def start_at(self, place: RobotPlace) -> None:
        """Where the robot stands until it says otherwise."""
        self._start = place

    @property
    def newest(self) -> RobotPose | None:
        """What the robot said last."""
        return self._poses[-1] if self._poses else None

    def hear(self, pose: RobotPose) -> None:
        """The robot says where it is. Poses of a clock that was set back since are forgotten: they lie in the future."""
        while self._poses and self._poses[-1].stamp_ns >= pose.stamp_ns:
            self._poses.pop()
        self._poses.append(pose)
        while len(self._poses) > 2 and pose.stamp_ns - self._poses[1].stamp_ns > KEPT_S * 1e9:
            self._poses.popleft()

    def at(self, stamp_ns: int) -> RobotFix:
        """Where the robot was at that time, between its words or a little beyond them."""
        newest = self.newest
        if newest is None:
            return RobotFix(self._start)
        ahead_s = (stamp_ns - newest.stamp_ns) / 1e9
        if ahead_s < -KEPT_S:
            # Media time of lockstep, or another host's clock: the stamps cannot be compared.
            return RobotFix(_place(newest), f"its stamps are {-ahead_s:.3g} s later than the frames', so the newest is used")
        if ahead_s > self._max_age_s:
            return RobotFix(_place(newest), f"{ahead_s:.3g} s older than the frame")
        if ahead_s >= 0:
            return RobotFix(self._beyond(newest, stamp_ns, ahead_s))
        return RobotFix(self._between(stamp_ns))

    def _beyond(self, newest: RobotPose, stamp_ns: int, ahead_s: float) -> RobotPlace:
        enough_ns = newest.stamp_ns - int(BASELINE_S * 1e9)
        before = next((pose for pose in reversed(self._poses) if pose.stamp_ns <= enough_ns), None)
        if before is None or ahead_s > EXTRAPOLATED_S or not _moves(before, newest):
            return _place(newest)
        return _along(before, newest, stamp_ns)

    def _between(self, stamp_ns: int) -> RobotPlace:
        after = bisect_right([pose.stamp_ns for pose in self._poses], stamp_ns)
        if after == 0:
            return _place(self._poses[0])
        first, second = self._poses[after - 1], self._poses[after]
        return _along(first, second, stamp_ns) if _moves(first, second) else _place(first)


def _moves(first: RobotPose, second: RobotPose) -> bool:
    return second.stamp_ns - first.stamp_ns <= MAX_GAP_S * 1e9


def _place(pose: RobotPose) -> RobotPlace:
    return RobotPlace(pose.x_m, pose.y_m, pose.yaw_deg)


def _along(first: RobotPose, second: RobotPose, stamp_ns: int) -> RobotPlace:
    """The place on the line through two poses, also beyond the second; the yaw goes the shorter way round."""
    share = (stamp_ns - first.stamp_ns) / (second.stamp_ns - first.stamp_ns)
    return RobotPlace(
        first.x_m + share * (second.x_m - first.x_m),
        first.y_m + share * (second.y_m - first.y_m),
        first.yaw_deg + share * wrapped_deg(second.yaw_deg - first.yaw_deg),
    )
