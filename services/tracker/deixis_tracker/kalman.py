"""Kalman filter of a point with constant velocity in the picture (Pateraki et al. 2011, sec. 4, [1])."""

from __future__ import annotations

import math


class PointFilter:
    """Position and velocity of one point; x and y share one covariance since their noise is equal.

    Positions are pixels, velocities pixels per second, times seconds.
    """

    def __init__(self, x: float, y: float, sigma_px: float, acceleration_px_s2: float) -> None:
        """Start at rest at (x, y), known to `sigma_px`; `acceleration_px_s2` is the spread of the unmodelled acceleration."""
        self.x, self.y, self.vx, self.vy = x, y, 0.0, 0.0
        self._pp, self._pv, self._vv = sigma_px**2, 0.0, (acceleration_px_s2 * 0.2) ** 2
        self._q = acceleration_px_s2**2

    @property
    def sigma_px(self) -> float:
        """Spread of the position."""
        return math.sqrt(self._pp)

    def shift_to(self, x: float, y: float) -> None:
        """Move the point without moving in time: the picture moved under it."""
        self.x, self.y = x, y

    def predict(self, dt_s: float) -> None:
        """Move on by `dt_s` seconds (white acceleration noise)."""
        self.x += self.vx * dt_s
        self.y += self.vy * dt_s
        pp, pv, vv = self._pp, self._pv, self._vv
        self._pp = pp + 2 * dt_s * pv + dt_s**2 * vv + self._q * dt_s**4 / 4
        self._pv = pv + dt_s * vv + self._q * dt_s**3 / 2
        self._vv = vv + self._q * dt_s**2

    def correct(self, x: float, y: float, sigma_px: float) -> None:
        """Take in a measurement of the position with spread `sigma_px`."""
        s = self._pp + sigma_px**2
        gain_p, gain_v = self._pp / s, self._pv / s
        dx, dy = x - self.x, y - self.y
        self.x += gain_p * dx
        self.y += gain_p * dy
        self.vx += gain_v * dx
        self.vy += gain_v * dy
        pp, pv, vv = self._pp, self._pv, self._vv
        self._pp, self._pv, self._vv = (1 - gain_p) * pp, (1 - gain_p) * pv, vv - gain_v * pv

    def limit(self, speed_px_s: float) -> None:
        """Bound the speed: a blob that changed its shape looks like a leap, and would shoot the track off."""
        speed = math.hypot(self.vx, self.vy)
        if speed > speed_px_s:
            self.damp(speed_px_s / speed)

    def restart(self, x: float, y: float, sigma_px: float) -> None:
        """At rest at (x, y): where a lost point was found again."""
        self.x, self.y, self.vx, self.vy = x, y, 0.0, 0.0
        self._pp, self._pv, self._vv = sigma_px**2, 0.0, self._q * 0.04

    def damp(self, factor: float) -> None:
        """Slow down: an unseen object is not flown out of the picture by its last speed."""
        self.vx *= factor
        self.vy *= factor
