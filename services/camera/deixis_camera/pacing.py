"""When a picture is published: rate limit, a recording's own rate, lockstep; when a recording starts; pauses between retries.

All times are of a monotonic clock, or of a recording's own: a wall clock that is set holds nothing up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from deixis_schemas import topics
from deixis_schemas.messages import FrameId

LOCKSTEP_EPOCH_NS = 1_000_000_000_000_000_000
"""Stamp of media time 0 in lockstep: 2001-09-09T01:46:40Z, a round number that nobody takes for today."""

OTHER_STAGES = frozenset(topics.STAGES) - {topics.FRAME.stage}
NEEDED_STAGES = frozenset({topics.TRACKS.stage, topics.BELIEF.stage})
REST_S = 3.0
USUAL_PERIOD_NS = 40_000_000


def period_ns(rate_hz: float) -> int:
    """Time from one picture of a recording to the next; that of 25 Hz where the rate is not known (0)."""
    return round(1e9 / rate_hz) if rate_hz > 0 else USUAL_PERIOD_NS


class RateLimit:
    """Lets through at most `rate_hz` pictures a second, evenly; all of them where it is 0."""

    def __init__(self, rate_hz: float) -> None:
        self._next_ns: int | None = None
        self.limit(rate_hz)

    def limit(self, rate_hz: float) -> None:
        """Set the rate from the next picture on."""
        self._period_ns = round(1e9 / rate_hz) if rate_hz else 0

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
        self._period_ns = period_ns(rate_hz)
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


class Lockstep:
    """Whether the next frame may go out: when fusion has answered the last, so that two runs are equal.

    What is played to its end goes as fast as it is answered. A `looped` recording has no end to hurry for, and all of the
    machine to take from others: it is played at its own rate at most.
    """

    def __init__(self, timeout_s: float, looped: bool = False) -> None:
        self._timeout_s = timeout_s
        self._looped = looped
        self._open: FrameId | None = None
        self._sent_s = 0.0
        self._media_ns: int | None = None

    def sent(self, frame_id: FrameId, media_ns: int, now_s: float) -> None:
        """The frame of `media_ns`, in the recording's time, was published."""
        self._open, self._media_ns, self._sent_s = frame_id, media_ns, now_s

    def answered(self, frame_id: FrameId) -> None:
        """fusion/belief of this frame came; one of another frame changes nothing."""
        if frame_id == self._open:
            self._open = None

    def may_feed(self, now_s: float) -> bool:
        """The last frame is answered, or its time is up."""
        return self._open is None or now_s - self._sent_s >= self._timeout_s

    def early_s(self, media_ns: int, now_s: float) -> float:
        """How long the frame of `media_ns` is before its time, s; 0 where it is not, or nothing is looped."""
        if not self._looped or self._media_ns is None:
            return 0.0
        return max(0.0, self._sent_s + (media_ns - self._media_ns) / 1e9 - now_s)

    def given_up(self) -> int | None:
        """`seq` of a frame whose answer never came, once; call it when `may_feed` says yes."""
        unanswered, self._open = self._open, None
        return unanswered.seq if unanswered else None


class Readiness:
    """Whether the other stages are there, so that no first frame is lost.

    Ready when all of them are alive and something receives frames; with tracker and fusion alone REST_S after those were seen
    (the rest may be left out, or be slower to start); and after `longest_s` in any case.
    """

    def __init__(self, started_s: float, longest_s: float) -> None:
        self._started_s = started_s
        self._longest_s = longest_s
        self._needed_since_s: float | None = None

    def ready(self, alive: set[str] | None, matching: bool, now_s: float) -> bool:
        """Whether to feed the first frame now; `alive` is None where any receiver will do (not in lockstep)."""
        there = alive is None or self._there(alive, now_s)
        return self.timed_out(now_s) or (matching and there)

    def timed_out(self, now_s: float) -> bool:
        """Waited `longest_s`."""
        return now_s - self._started_s >= self._longest_s

    def _there(self, alive: set[str], now_s: float) -> bool:
        if not alive >= NEEDED_STAGES:
            self._needed_since_s = None
            return False
        if self._needed_since_s is None:
            self._needed_since_s = now_s
        return alive >= OTHER_STAGES or now_s - self._needed_since_s >= REST_S


def missing(alive: set[str] | None) -> str:
    """What a timed-out Readiness waited for, to begin a message."""
    absent = ", ".join(sorted(NEEDED_STAGES - alive)) if alive is not None else ""
    return f"not alive: {absent}" if absent else "no stage has asked for frames"


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
