"""When a process that ended is started again, and when it is given up. No clock, no processes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

LIMIT = 5
WINDOW_S = 60.0
PAUSE_S = 0.25
PAUSE_MAX_S = 8.0


@dataclass(frozen=True)
class Verdict:
    """Start it again after this pause, or give it up for this reason."""

    pause_s: float = 0.0
    given_up: str = ""


class Restarts:
    """Of one process. The first restart is at once, for most ends come alone; the next ones wait longer and longer."""

    def __init__(self) -> None:
        self._ends: deque[float] = deque(maxlen=LIMIT)
        self._blameless = 0

    def after(self, why: str, now_s: float, *, blameless: bool = False) -> Verdict:
        """What to do about an end at this monotonic time; `why` says it in words.

        A `blameless` end was another's fault: it is repeated slowly, but never the reason to give a process up.
        """
        if blameless:
            self._blameless += 1
            return Verdict(_pause_s(self._blameless))
        self._blameless = 0
        if len(self._ends) == LIMIT and now_s - self._ends[0] < WINDOW_S:
            return Verdict(given_up=f"it ended {LIMIT + 1} times within {WINDOW_S:.0f} s, the last time: {why}")
        earlier = sum(now_s - at < WINDOW_S for at in self._ends)
        self._ends.append(now_s)
        return Verdict(_pause_s(earlier))


def _pause_s(earlier: int) -> float:
    """The pause after so many earlier ends."""
    return min(PAUSE_MAX_S, PAUSE_S * 2 ** (earlier - 1)) if earlier else 0.0
