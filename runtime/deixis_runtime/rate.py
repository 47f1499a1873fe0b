"""Rate of a counter, for the health record."""

from __future__ import annotations

WINDOW_S = 1.0


class Rate:
    """Per second, over the time since the last reading that is at least a window ago."""

    def __init__(self, now_s: float) -> None:
        self._since_s = now_s
        self._before = 0
        self._rate_hz = 0.0

    def of(self, count: int, now_s: float) -> float:
        """The rate now that the counter shows `count`."""
        passed_s = now_s - self._since_s
        if passed_s >= WINDOW_S:
            self._rate_hz = round((count - self._before) / passed_s, 2)
            self._since_s, self._before = now_s, count
        return self._rate_hz
