"""A frame's place in time. What the tracker does is timed in seconds, so that every frame rate gives the same tracks."""

from __future__ import annotations

from typing import NamedTuple

SLACK_NS = 4_000_000  # stamps are rounded, and cameras jitter: what is due a moment later is due now


class Step(NamedTuple):
    """One frame: steady time, time since the run began, and since the frame before (never longer than half a second)."""

    now_ns: int
    run_ns: int
    passed_ns: int

    @property
    def passed_s(self) -> float:
        """Since the frame before."""
        return self.passed_ns / 1e9

    def periods(self, period_s: float, ahead_s: float = 0.0) -> int:
        """How many periods ended since the frame before: 0 where what is done once a period is not due.

        `ahead_s` shifts the beats, so that not all work falls into the same frames.
        """
        period_ns, now_ns = round(period_s * 1e9), self.run_ns + round(ahead_s * 1e9) + SLACK_NS
        return now_ns // period_ns - (now_ns - self.passed_ns) // period_ns

    def kept(self, share_per_s: float) -> float:
        """What is left of a quantity of which that share is left after a second."""
        return float(share_per_s**self.passed_s)

    def learned(self, share_per_s: float) -> float:
        """How far to move toward the new, where after a second that share of the old is left."""
        return 1 - self.kept(share_per_s)


def repeated(rate: float, times: int) -> float:
    """How far `times` moves by `rate` toward the same goal lead."""
    return float(1 - (1 - rate) ** times)
