"""How far the yaw may be off: a model of the sigma, fitted to measured errors."""

from __future__ import annotations


def yaw_sigma_deg(yaw_deg: float, correlation: float, held_s: float) -> float:
    """Standard deviation of the yaw, degrees.

    It grows with the turn, as the head's size is not known exactly, and beyond 60 degrees with the number of keyframes that
    the turn was chained over. A weak match adds to it; so does every second that the pose is held without one.
    """
    turn = abs(yaw_deg)
    return 1.2 + 0.05 * turn + 0.15 * max(0.0, turn - 60.0) + 10 * max(0.0, 0.95 - correlation) + 60 * held_s
