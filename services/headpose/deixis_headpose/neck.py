"""Where the head can be: on a neck that moves calmly.

Matching alone confuses a turn with a shift (5 degrees of yaw for each centimetre, at a correlation of .98 either way), and read
fast turns up to 15 % short. A head that turns moves sideways by what its neck allows; that ties the two together.
"""

from __future__ import annotations

import numpy as np

from .head import Array, Pose
from .lsm import Prior

LEVER_M = 0.032
"""How far before the axis that it turns about the head's centre lies; 0.03 for the neck alone, more with the torso."""
SIGMA_M = np.array([0.022, 0.02, 0.004])
"""How well the neck's place is known: across, up, along the line of sight."""
TURN_SIGMA = np.radians([25.0, 60.0, 25.0])
"""Turn from the start of a matching about x, y, z: wide, for a prior on the yaw shortens fast turns."""
FOLLOW_PER_S, FOLLOW_SPEED_PER_S = 6.0, 0.75
"""Gains of the constant-velocity filter of the neck: shares of the error that go into place and speed, per second."""
LEAST_GAP_S, LARGEST_GAP_S = 1 / 150, 0.2
"""Matches nearer and farther apart than this are followed as if they were this far apart."""


class Neck:
    """Constant-velocity filter (alpha-beta) of the point that the head turns about; it starts at a speed in m/s, (3,)."""

    def __init__(self, pose: Pose, speed_m_s: Array | None = None) -> None:
        self._place: Array = pose.position_m - _lever(pose)
        self._speed: Array = np.zeros(3) if speed_m_s is None else speed_m_s

    def prior(self, start: Pose, dt: float) -> Prior:
        """What is expected of the pose `dt` seconds after the last update, as a step from `start`."""
        expected = self._place + self._speed * dt + _lever(start)
        # Rows of the linearised condition `position - lever(yaw) = neck`: a turn about y by w lowers the yaw by w.
        yaw = _yaw(start)
        rows = np.hstack([np.zeros((3, 3)), np.eye(3)])
        rows[0, 1] = LEVER_M * np.cos(yaw)
        weighted = rows / SIGMA_M[:, None] ** 2
        information = weighted.T @ rows + np.diag([*TURN_SIGMA**-2.0, 0.0, 0.0, 0.0])
        return Prior(information, weighted.T @ (expected - start.position_m))

    def update(self, pose: Pose, dt: float) -> None:
        """Follow a matched pose, `dt` seconds after the last."""
        gap = min(max(dt, LEAST_GAP_S), LARGEST_GAP_S)
        self._place = self._place + self._speed * dt
        error = pose.position_m - _lever(pose) - self._place
        self._place = self._place + min(1.0, FOLLOW_PER_S * gap) * error
        self._speed = self._speed + min(1.0, FOLLOW_SPEED_PER_S * gap) * error / dt if dt > 0 else self._speed

    def rest(self) -> None:
        """Expect no further motion, as when the head is not matched."""
        self._speed = np.zeros(3)


def _yaw(pose: Pose) -> float:
    return float(np.radians(pose.angles_deg()[0]))


def _lever(pose: Pose) -> Array:
    return np.array([LEVER_M * np.sin(_yaw(pose)), 0.0, 0.0])
