"""Lockstep: the next frame when fusion has answered the last, stamped with media time, so that two runs are equal."""

from __future__ import annotations

from deixis_schemas.messages import FrameId

EPOCH_NS = 1_000_000_000_000_000_000
"""Stamp of media time 0 in lockstep: 2001-09-09T01:46:40Z, a round number that nobody takes for today."""

NEEDED = frozenset({"tracker", "fusion"})
ALL = frozenset({"tracker", "headpose", "gesture", "fusion"})
REST_S = 3.0


class Lockstep:
    """Whether the next frame may go out."""

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._open: FrameId | None = None
        self._sent_s = 0.0

    def sent(self, frame_id: FrameId, now_s: float) -> None:
        """The frame was published."""
        self._open, self._sent_s = frame_id, now_s

    def answered(self, frame_id: FrameId) -> None:
        """fusion/belief of this frame came; one of another frame changes nothing."""
        if frame_id == self._open:
            self._open = None

    def may_feed(self, now_s: float) -> bool:
        """The last frame is answered, or its time is up."""
        return self._open is None or now_s - self._sent_s >= self._timeout_s

    def given_up(self) -> int | None:
        """`seq` of a frame whose answer never came, once; call it when `may_feed` says yes."""
        unanswered, self._open = self._open, None
        return unanswered.seq if unanswered else None


class Readiness:
    """Whether the other stages are there, so that no first frame is lost.

    Ready when all four stages are alive and something receives frames; with tracker and fusion alone REST_S after those were
    seen (headpose and gesture may be left out, or be slower to start); and after `longest_s` in any case.
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
        if not alive >= NEEDED:
            self._needed_since_s = None
            return False
        if self._needed_since_s is None:
            self._needed_since_s = now_s
        return alive >= ALL or now_s - self._needed_since_s >= REST_S


def missing(alive: set[str] | None) -> str:
    """What a timed-out Readiness waited for, to begin a message."""
    absent = ", ".join(sorted(NEEDED - alive)) if alive is not None else ""
    return f"not alive: {absent}" if absent else "no stage has asked for frames"
