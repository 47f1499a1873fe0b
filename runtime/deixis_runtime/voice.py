"""Which frames a process of a stage answers while another takes its place: the core of a hot swap. No clock, no I/O.

Two processes of a stage hear the same frames. The one that is heard names a frame a little ahead, once; it answers those before
it, and the newcomer that one and those behind it. So no frame is answered by both, whatever comes late or not at all.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from deixis_schemas.messages import FrameId, VoiceState

LEAD_FRAMES = 15
"""How far ahead the frame is that is named: half a second at 30 Hz, in which the newcomer has to hear of it."""
FLOWING_S = 1.0
"""Where the last frame is older, none is on its way: the next one is the newcomer's."""
TAKE_WITHIN_S = 1.5
"""From the newcomer's question on; an answer that comes later counts for nothing."""
TAKEN_WITHIN_S = 2.5
"""From the old one's answer on: a newcomer that is not heard of by then has not taken it. More than TAKE_WITHIN_S."""
ABSENT_S = 0.1
"""A token that is gone for so long is gone: tokens change places, too."""
SPARE_ABSENT_S = 1.0
"""The same for one that was never heard: who has yielded the place is to have it back first."""
LINKED_S = 3.0
"""When a router starts again all tokens go, and come back one by one: before this nobody's absence is believed."""
LEAVE_AFTER_S = 60.0
"""So long a process that has yielded stands by in case the newcomer fails, unless it is told to leave before."""
RUNS_KEPT = 16

Place = tuple[int, int]

FIRST: Place = (-1, -1)
NEVER: Place = (1 << 62, 0)


class YieldRefused(ValueError):
    """Why a process does not yield or take; the text goes to the one who asked."""


@dataclass(frozen=True)
class Seen:
    """What a process knows of the others of its stage at one time.

    alive: the others that speak, by their tokens; first_spare: whether none that stands by comes before this one. linked_s: for
    how long it has had the link to its router.
    """

    alive: Collection[str]
    first_spare: bool
    linked_s: float
    now_s: float


class FrameOrder:
    """Frames in the order of their coming: within a run by `seq`, runs in the order in which this process met them."""

    def __init__(self) -> None:
        self._runs: dict[int, int] = {}
        self._met = 0

    def place(self, frame: FrameId) -> Place:
        """Where the frame stands; a run not met before is the newest."""
        if frame.run not in self._runs:
            self._runs[frame.run] = self._met
            self._met += 1
            if len(self._runs) > RUNS_KEPT:
                del self._runs[min(self._runs, key=self._runs.__getitem__)]
        return self._runs[frame.run], frame.seq


@dataclass
class Voice:
    """One process's part. Times are monotonic seconds of this host; both sides measure spans only.

    other: with whom it changes places, or has; fence: the first frame of the newcomer, none where all frames are.
    """

    standing_by: bool = False
    other: str = ""
    fence: FrameId | None = None
    reason: str = ""
    _order: FrameOrder = field(default_factory=FrameOrder)
    _from: Place = FIRST
    _until: Place = NEVER
    _newest: FrameId | None = None
    _newest_s: float = 0.0
    _passed: Place = FIRST
    _heard: Place = FIRST
    _yielded_s: float | None = None
    _asked_s: float | None = None
    _seen_s: float | None = None
    _absent_since_s: float | None = None
    _absent_s: float = SPARE_ABSENT_S

    def __post_init__(self) -> None:
        if self.standing_by:
            self._from = NEVER

    @property
    def state(self) -> VoiceState:
        """As others are told it."""
        if self._yielded_s is not None:
            return "yields"
        if self._asked_s is not None:
            return "asks"
        return "stands_by" if self._from == NEVER else "speaks"

    @property
    def heard(self) -> bool:
        """Whether this process holds its stage's place: it is to have the token of one that works."""
        return self.state == "speaks"

    # --- frames -------------------------------------------------------------------------------------------------------

    def answers(self, frame: FrameId, now_s: float) -> bool:
        """Whether the answer to this frame, which is ready, is ours to give. To be asked once for each."""
        place = self._order.place(frame)
        ours = self._from <= place < self._until and place > self._passed
        if place > self._passed:
            self._passed, self._newest = place, frame
        self._newest_s = now_s
        return ours

    def hear(self, frame: FrameId) -> None:
        """Another process has answered this frame: should we come to speak, it is not ours, nor are those before it."""
        self._heard = max(self._heard, self._order.place(frame))

    # --- the one that is heard ----------------------------------------------------------------------------------------

    def yield_to(self, other: str, now_s: float) -> FrameId | None:
        """Promise this newcomer a frame and all behind it; none where it may have all. Asked again, it is told the same.

        Raises YieldRefused.
        """
        if self._yielded_s is not None and self.other == other:
            self._yielded_s = now_s  # its first answer may have been lost
            return self.fence
        if self._yielded_s is not None:
            raise YieldRefused(f"it yields to {self.other} already: one swap at a time")
        if not self.heard:
            raise YieldRefused("it is not heard itself: it stands by")
        self.other, self.reason = other, ""
        self.fence = self._ahead(now_s)
        self._until = FIRST if self.fence is None else self._order.place(self.fence)
        self._yielded_s, self._seen_s, self._absent_since_s = now_s, None, None
        return self.fence

    def _ahead(self, now_s: float) -> FrameId | None:
        if self._newest is None:
            return None
        flowing = now_s - self._newest_s < FLOWING_S
        ahead = FrameId(self._newest.run, self._newest.seq + 1 + (LEAD_FRAMES if flowing else 0))
        # A place that was taken over may begin later. By where it stood when it was taken: its run may be forgotten by now.
        return self.fence if self.fence is not None and self._from > self._order.place(ahead) else ahead

    def must_stay(self, now_s: float) -> str:
        """Why it may not end now as one that was replaced; empty where it may."""
        if self._yielded_s is None:
            return "it has not yielded to anybody"
        if self._seen_s is None or self._absent_since_s is not None:
            return f"{self.other} has not taken its place"
        last_of_ours = (self._until[0], self._until[1] - 1)
        if max(self._passed, self._heard) < last_of_ours and now_s - self._newest_s < FLOWING_S:
            return f"the frames before {self.fence.seq if self.fence else 0} are still to be answered"
        return ""

    def is_to_leave(self, now_s: float) -> bool:
        """Whether it has stood by long enough behind its successor."""
        return self._seen_s is not None and now_s - self._seen_s > LEAVE_AFTER_S and not self.must_stay(now_s)

    # --- the newcomer -------------------------------------------------------------------------------------------------

    def ask(self, other: str, now_s: float) -> None:
        """From now on it asks this process to yield. Raises YieldRefused."""
        if self.state != "stands_by":
            raise YieldRefused("it does not stand by")
        self.other, self.reason, self._asked_s = other, "", now_s

    def take(self, fence: FrameId | None, now_s: float) -> bool:
        """The answer has come: the frames from there on are ours, unless it came too late to count."""
        if self._asked_s is None or self.asks_in_vain(now_s):
            return False
        self._asked_s = None
        self.fence = fence
        self._from = FIRST if fence is None else self._order.place(fence)
        return True

    def refused(self, why: str) -> None:
        """The other does not yield: it stands by as before."""
        self._asked_s, self.reason = None, why

    def unanswered(self) -> None:
        """The other has not answered in time, as one that knows nothing of this: it stands by, close behind it."""
        self.refused(f"{self.other} has not answered within {TAKE_WITHIN_S:g} s")
        self._absent_s = ABSENT_S

    def asks_in_vain(self, now_s: float) -> bool:
        """Whether the answer would come too late by now."""
        return self._asked_s is not None and now_s - self._asked_s > TAKE_WITHIN_S

    # --- when one of them fails ---------------------------------------------------------------------------------------

    def look(self, seen: Seen) -> str:
        """Take the place back, or take it over, where nobody has it; what has happened, in words, or nothing."""
        if seen.linked_s < LINKED_S:
            return ""
        if self._yielded_s is not None:
            return self._look_at_successor(seen, self._yielded_s)
        if self.other in seen.alive and self.reason and self.heard:
            return self._hush(seen.now_s)
        held = bool(seen.alive) or not seen.first_spare
        if self.state == "stands_by" and self._is_absent(held, seen.now_s, self._absent_s):
            self._begin()
            return "nobody speaks for the stage: it does"
        return ""

    def _look_at_successor(self, seen: Seen, yielded_s: float) -> str:
        if seen.alive:
            self._seen_s = seen.now_s if self._seen_s is None else self._seen_s
            self._absent_since_s = None
            return ""
        never = self._seen_s is None
        if never and seen.now_s - yielded_s < TAKEN_WITHIN_S:
            return ""
        if not never and not self._is_absent(False, seen.now_s, ABSENT_S):
            return ""
        self.reason = f"{self.other} has not taken the place" if never else f"{self.other} is gone"
        self._begin()
        return f"{self.reason}: it speaks again"

    def _is_absent(self, anybody: bool, now_s: float, for_s: float) -> bool:
        """Whether nobody has been there for so long."""
        if anybody:
            self._absent_since_s = None
            return False
        self._absent_since_s = now_s if self._absent_since_s is None else self._absent_since_s
        return now_s - self._absent_since_s >= for_s

    def _begin(self) -> None:
        """Answer all that comes from now on: what was passed over or heard is not answered a second time."""
        self._from, self._until, self._passed = FIRST, NEVER, max(self._passed, self._heard)
        self._yielded_s = self._seen_s = self._absent_since_s = None

    def _hush(self, now_s: float) -> str:
        """The successor was out of sight only, behind a link that was cut, and is back: what was promised still holds."""
        self._until, self._yielded_s, self._seen_s, self.reason = FIRST, now_s, now_s, ""
        return f"{self.other} is back: it has the place"
