"""How far the clock of another host is ahead of ours, by questions and answers. Pure: times in, an estimate out.

One exchange is NTP's: asked at t0 and answered at t3 by our clock, at t1 by the other's. The answer was given somewhere in
between, so the other clock is ahead by t1 - (t0 + t3) / 2, give or take half the round trip, however unlike the two ways are.

Our clock in this is the monotonic one, which nobody sets: how far the other is ahead of our wall clock is `beside` that.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

KEPT = 16
KEPT_NS = 60 * 10**9
# Two quartz clocks drift apart by less than this, of which 1e-4 is far out for either.
DRIFT = 2e-4


@dataclass(frozen=True)
class Exchange:
    """One question and its answer: asked and returned by our monotonic clock, answered by the other's wall clock."""

    asked_ns: int
    answered_ns: int
    returned_ns: int

    @property
    def ahead_ns(self) -> int:
        """How far the other clock is ahead of our monotonic one, nanoseconds."""
        return self.answered_ns - (self.asked_ns + self.returned_ns) // 2

    @property
    def uncertain_ns(self) -> int:
        """By how much `ahead_ns` may be wrong at that time."""
        return (self.returned_ns - self.asked_ns + 1) // 2


@dataclass(frozen=True)
class Offset:
    """How far another clock is ahead of ours (behind: negative), and by how much that may be wrong, nanoseconds."""

    ahead_ns: int
    uncertain_ns: int

    @property
    def surely_ns(self) -> int:
        """The part of it that is certain: 0 where the clocks may well be equal."""
        if self.ahead_ns > 0:
            return max(0, self.ahead_ns - self.uncertain_ns)
        return min(0, self.ahead_ns + self.uncertain_ns)

    def beside(self, wall_less_monotonic_ns: int) -> Offset:
        """The same beside our wall clock, which is that far ahead of our monotonic clock now."""
        return Offset(self.ahead_ns - wall_less_monotonic_ns, self.uncertain_ns)

    @property
    def correction_ns(self) -> int:
        """What to take for the offset: clocks that may well be equal are taken to be so."""
        return self.ahead_ns if abs(self.ahead_ns) > self.uncertain_ns else 0


class ClockOffset:
    """How far one other clock is ahead of our monotonic clock, by the exchanges of the last minute.

    The quickest exchange is the best one; drift makes old ones worse. Intervals of two honest exchanges overlap, so one that
    overlaps not with all that are kept says that the other clock was set, and what was known before is forgotten.
    """

    def __init__(self) -> None:
        self.steps = 0
        self._kept: deque[Exchange] = deque(maxlen=KEPT)

    def note(self, new: Exchange) -> None:
        """An exchange ended."""
        if any(_apart(old, new) for old in self._kept):
            self._kept.clear()
            self.steps += 1
        self._kept.append(new)

    def forget(self) -> None:
        """It is another clock from now on."""
        self._kept.clear()

    def at(self, now_ns: int) -> Offset | None:
        """The estimate at `now_ns` of our monotonic clock. None where no exchange of the last minute is known."""
        young = [item for item in self._kept if now_ns - item.returned_ns <= KEPT_NS]
        if not young:
            return None
        best = min(young, key=lambda item: _uncertain_ns(item, now_ns))
        return Offset(best.ahead_ns, _uncertain_ns(best, now_ns))


def surely_passed_ns(stamp_ns: int, now_ns: int, offset: Offset) -> int:
    """How long ago a stamp of the other clock is at least, at `now_ns` of our monotonic clock, beside which `offset` is."""
    return now_ns + offset.ahead_ns - offset.uncertain_ns - stamp_ns


def estimate(exchanges: Iterable[Exchange]) -> Offset | None:
    """The offset by a few exchanges, at the end of the last one. None where there are none."""
    offset = ClockOffset()
    last_ns = 0
    for item in sorted(exchanges, key=lambda item: item.returned_ns):
        offset.note(item)
        last_ns = item.returned_ns
    return offset.at(last_ns)


def _uncertain_ns(item: Exchange, now_ns: int) -> int:
    return item.uncertain_ns + math.ceil(max(0, now_ns - item.asked_ns) * DRIFT)


def _apart(old: Exchange, new: Exchange) -> bool:
    """Whether the intervals of the two do not overlap, drift between them allowed for. A rounded nanosecond is none."""
    return abs(old.ahead_ns - new.ahead_ns) > _uncertain_ns(old, new.returned_ns) + _uncertain_ns(new, new.returned_ns) + 2
