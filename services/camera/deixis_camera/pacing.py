"""When a picture is published: a rate limit, a recording's own rate, and the pauses between retries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


class RateLimit:
    """Lets through at most `rate_hz` pictures a second, evenly; all of them where it is None."""

    def __init__(self, rate_hz: float | None) -> None:
        self._period_ns = round(1e9 / rate_hz) if rate_hz else 0
        self._next_ns: int | None = None

    def lets(self, time_ns: int) -> bool:
        """Whether the picture of `time_ns` (of any clock; a step back starts anew) is to be published."""
        due = self._next_ns
        if due is None or abs(time_ns - due) > 2 * self._period_ns:
            self._next_ns = time_ns + self._period_ns
            return True
        # A tenth of a period early is in time: 30 Hz pictures come after 33 or 34 ms, and a limit of 30 must pass them all.
        if time_ns < due - self._period_ns // 10:
            return False
        self._next_ns = due + self._period_ns
        return True


@dataclass(frozen=True)
class Decision:
    """What to do with the next picture of a recording.

    publish: now, as captured `late_ns` ago; wait: `wait_s` more; drop: its time has passed and a newer one is there.
    """

    act: Literal["publish", "wait", "drop"]
    wait_s: float = 0.0
    late_ns: int = 0
    fell_behind: bool = False


class OwnRate:
    """Plays a recording at its own rate against a monotonic clock.

    A picture whose time has passed by more than a period is dropped where a newer one is ready, as a camera drops what nobody
    fetched in time. Where none is ready the reader is too slow for the rate: then the picture goes out and the rest of the
    recording moves back by as much, for dropping all that is late would drop everything from then on.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = round(1e9 / rate_hz) if rate_hz > 0 else 40_000_000
        self._start_ns: int | None = None

    def decide(self, media_ns: int, now_ns: int, newer_ready: bool) -> Decision:
        """Decide on the picture of `media_ns`; the first one starts the clock."""
        if self._start_ns is None:
            self._start_ns = now_ns - media_ns
        late_ns = now_ns - self._start_ns - media_ns
        if late_ns < 0:
            return Decision("wait", wait_s=-late_ns / 1e9)
        if late_ns <= self._period_ns:
            return Decision("publish", late_ns=late_ns)
        if newer_ready:
            return Decision("drop", late_ns=late_ns)
        self._start_ns += late_ns
        return Decision("publish", fell_behind=True)


class Backoff:
    """Pauses between retries: doubled from `first_s` to `longest_s`, back to `first_s` after a success."""

    def __init__(self, first_s: float, longest_s: float) -> None:
        self._first_s = first_s
        self._longest_s = max(first_s, longest_s)
        self._next_s = first_s

    def next_s(self) -> float:
        """The pause before the next try."""
        pause = self._next_s
        self._next_s = min(self._longest_s, 2 * pause)
        return pause

    def succeeded(self) -> None:
        """Pictures came: the next loss is a new one."""
        self._next_s = self._first_s
