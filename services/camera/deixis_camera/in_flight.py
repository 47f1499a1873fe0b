"""Frames that were sent and not answered yet: how long answers take, and whether one more frame may follow. Pure.

The far end measures: a frame counts as arrived when a stage that looks at it has answered it, with a message that repeats its
`run` and `seq`. Sent and answered are both times of our own clock, so clocks that differ do no harm. What waits in a queue on
the way, whichever it is, makes answers late: then no more is sent until they come, and the queue stays as short as that.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import median

from deixis_schemas.messages import FrameId

BUCKET_S = 15.0
MAX_KEPT = 256
FIRST_QUICKEST_S = 0.15
"""Taken for the quickest answer while there was none."""
LONGEST_QUICKEST_S = 0.4
"""Answers that are never quicker than this are late, whatever they are used to: evidence would be too old."""
PROBE_S = 0.25
LONGEST_PROBE_S = 1.0


@dataclass(frozen=True)
class Arrival:
    """What one answer says: the time from sending to it, the frame's bytes, and how many sent before it had none."""

    took_s: float
    size: int
    passed_over: int


@dataclass(frozen=True)
class _Sent:
    frame_id: FrameId
    size: int
    at_s: float


class InFlight:
    """The frames on their way to a reader, oldest first."""

    def __init__(self, slack_s: float) -> None:
        """`slack_s`: how much longer than the quickest answer of late a frame may be under way before the next waits."""
        self._slack_s = slack_s
        self._sent: deque[_Sent] = deque(maxlen=MAX_KEPT)
        self._took_s: deque[float] = deque(maxlen=5)
        self._last_sent_s = 0.0
        self._last_took_s = 0.0
        self._bucket_began_s = 0.0
        self._quickest_s: float | None = None
        self._quickest_before_s: float | None = None

    def sent(self, frame_id: FrameId, size: int, now_s: float) -> None:
        """A frame went out."""
        self._sent.append(_Sent(frame_id, size, now_s))
        self._last_sent_s = now_s

    def answered(self, frame_id: FrameId, now_s: float) -> Arrival | None:
        """A reader answered the frame; frames before it have been overtaken. None for one that is not under way (any more)."""
        passed_over = next((i for i, sent in enumerate(self._sent) if sent.frame_id == frame_id), None)
        if passed_over is None:
            return None
        for _ in range(passed_over):
            self._sent.popleft()
        sent = self._sent.popleft()
        self._last_took_s = now_s - sent.at_s
        self._took_s.append(self._last_took_s)
        self._note_quickest(median(self._took_s), now_s)
        return Arrival(self._last_took_s, sent.size, passed_over)

    def may_send(self, now_s: float) -> bool:
        """Whether the next frame may follow: what is under way is not late, or it is time to try again."""
        if self.waited_s(now_s) <= self.quickest_s() + self._slack_s:
            return True
        return now_s - self._last_sent_s >= min(max(PROBE_S, self._last_took_s), LONGEST_PROBE_S)

    def waited_s(self, now_s: float) -> float:
        """How long the oldest frame under way has been so; 0 without one."""
        return now_s - self._sent[0].at_s if self._sent else 0.0

    def quickest_s(self) -> float:
        """The quickest answers of the last 15 to 30 s, as the median of five: what a frame needs where none waits before it.

        One alone may have been lucky: on a busy machine the quickest answer of all is far from the usual.
        """
        known = [took for took in (self._quickest_s, self._quickest_before_s) if took is not None]
        return min([*known, LONGEST_QUICKEST_S]) if known else FIRST_QUICKEST_S

    def forget(self) -> None:
        """What is under way is not waited for any more."""
        self._sent.clear()

    def _note_quickest(self, took_s: float, now_s: float) -> None:
        if now_s - self._bucket_began_s >= BUCKET_S:
            self._quickest_before_s, self._quickest_s = self._quickest_s, None
            self._bucket_began_s = now_s
        self._quickest_s = took_s if self._quickest_s is None else min(self._quickest_s, took_s)
