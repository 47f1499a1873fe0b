"""How far the yaw may be off: a model of the sigma, fitted to measured errors."""

from __future__ import annotations


def yaw_sigma_deg(yaw_deg: float, correlation: float, held_s: float) -> float:
    """Standard deviation of the yaw, degrees."""
    return 1.2 + 0.075 * abs(yaw_deg) + 10 * max(0.0, 0.95 - correlation) + 60 * held_s
