"""How much the camera sends, by how its frames arrive: when a picture is held back, and when to take another rung. Pure.

Two parts, one quick and one slow. `InFlight` holds a picture back while those before it are late, so no queue on the way grows,
whatever the link does. The ladder follows within seconds: where many pictures are held back, or half of the answers stay late,
frames are too large or too many, and it goes down to what came through; where all goes well for a while it goes up one rung,
to try. A rung that was tried
in vain is tried again after twice as long each time, so nothing swings to and fro.

Silence, as of a cut link, is something else: nobody knows what the link will carry when it is back. Then few and small frames
go out to ask, and with the first answer the way up to the rung before is a quick one.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

from deixis_schemas.messages import FrameId

from .in_flight import InFlight
from .ladder import Rung

PERIOD_S = 1.0
CLIMBING_PERIOD_S = 0.5
LONGEST_PERIOD_S = 2.0
LEAST_PICTURES = 3
"""Periods with fewer pictures due say nothing yet."""
MANY_HELD = 0.25
FEW_HELD = 0.05
LATE = 2 / 3
"""Of the slack: answers that are so much later than the quickest, half of them, wait behind others."""
LATE_S = 2.0
"""Lateness that stands so long is a queue; a shorter one may be chance."""
MOST_DOWN = 3
"""Rungs down at once, at most: what a second showed may be a passing trouble."""
USABLE = 0.85
"""Of the bytes a second that came through, to leave room for those that vary."""
MOST_UP = 2
"""Rungs up at once on the way back, which is less than twice the bytes; else one."""
FIRST_HOLD_S = 1.0
LONGEST_HOLD_S = 30.0
TRIED_S = 10.0
"""Trouble so soon after a step up means that the step was too much: a queue may grow slowly."""
SILENT_S = 1.0


@dataclass(frozen=True)
class LinkReport:
    """What is known of the way to the readers: bytes a second and the median time to an answer lately, the quickest time."""

    rung: Rung
    is_best: bool
    silent: bool
    bytes_s: float
    took_s: float | None
    quickest_s: float


class _Period:
    """What happened since `began_s`."""

    def __init__(self, began_s: float) -> None:
        self.began_s = began_s
        self.due = 0
        self.held = 0
        self.arrived_bytes = 0
        self.took_s: list[float] = []

    def is_over(self, now_s: float, usual_s: float) -> bool:
        """Whether it is long enough to judge by, as a rule `usual_s`."""
        long = now_s - self.began_s
        return (long >= usual_s and self.due >= LEAST_PICTURES) or long >= LONGEST_PERIOD_S

    def share_held(self) -> float:
        return self.held / self.due if self.due else 0.0


class Adaptation:
    """Decides on each picture, and on the rung. Call `due` for each picture, `sent` for each frame, `turn` often."""

    def __init__(self, rungs: tuple[Rung, ...], slack_s: float, now_s: float) -> None:
        """Begins on the lowest rung and climbs quickly: the first frames must not clog a link that nobody knows."""
        self._rungs = rungs
        self._slack_s = slack_s
        self._in_flight = InFlight(slack_s)
        self._at = len(rungs) - 1
        self._back_to = 0
        self._silent = False
        self._hold_s = [FIRST_HOLD_S] * len(rungs)
        self._good_s = 0.0
        self._late_s = 0.0
        self._climbed_s = now_s - TRIED_S
        self._down_s = now_s - LONGEST_HOLD_S
        self._down_from = 0
        self._heard_s = now_s
        self._period = _Period(now_s)
        self._size = 0.0
        self._size_quality: int | None = None
        self._bytes_s = 0.0
        self._took_s: float | None = None

    @property
    def rung(self) -> Rung:
        """What to send now."""
        return self._rungs[self._at]

    def due(self, now_s: float) -> bool:
        """A picture is there: whether it may go out."""
        may = self._in_flight.may_send(now_s)
        self._period.due += 1
        self._period.held += not may
        return may

    def sent(self, frame_id: FrameId, size: int, quality: int | None, now_s: float) -> None:
        """A frame of so many bytes went out."""
        if not self._in_flight.waited_s(now_s):
            self._heard_s = max(self._heard_s, now_s)  # nothing was owed until now: no silence
        self._in_flight.sent(frame_id, size, now_s)
        self._size = size if quality != self._size_quality or not self._size else 0.9 * self._size + 0.1 * size
        self._size_quality = quality

    def answered(self, frame_id: FrameId, now_s: float) -> None:
        """A stage answered the frame."""
        arrival = self._in_flight.answered(frame_id, now_s)
        if arrival is None:
            return
        self._heard_s = now_s
        self._period.arrived_bytes += arrival.size
        self._period.took_s.append(arrival.took_s)
        if self._silent:
            self._silent = False
            self._begin_period(now_s)

    def turn(self, now_s: float) -> None:
        """Take another rung where it is time to."""
        if self._in_flight.waited_s(now_s) and now_s - self._heard_s >= SILENT_S:
            self._fall_silent(now_s)
        elif not self._silent and self._period.is_over(now_s, CLIMBING_PERIOD_S if self._climbing() else PERIOD_S):
            self._judge(now_s)
            self._begin_period(now_s)

    def report(self) -> LinkReport:
        """For people."""
        return LinkReport(self.rung, self._at == 0, self._silent, self._bytes_s, self._took_s, self._in_flight.quickest_s())

    # --- inside -------------------------------------------------------------------------------------------------------

    def _fall_silent(self, now_s: float) -> None:
        if self._silent:
            return
        self._silent = True
        if now_s - self._down_s <= SILENT_S + PERIOD_S:
            self._back_to = self._down_from  # that trouble was the cut's beginning
        elif not self._climbing():
            self._back_to = self._at
        self._at = len(self._rungs) - 1
        self._took_s, self._bytes_s = None, 0.0
        self._begin_period(now_s)

    def _judge(self, now_s: float) -> None:
        period = self._period
        long_s = now_s - period.began_s
        self._bytes_s = period.arrived_bytes / long_s
        self._took_s = median(period.took_s) if period.took_s else None
        if period.share_held() > MANY_HELD:
            self._go_down(now_s)
            return
        late = self._took_s is not None and self._took_s > self._in_flight.quickest_s() + LATE * self._slack_s
        self._late_s = self._late_s + long_s if late else 0.0
        if self._late_s >= LATE_S:
            self._go_down(now_s)
        elif period.share_held() <= FEW_HELD and period.took_s and not late:
            self._good_s += long_s
            if self._at > 0 and self._good_s >= self._needed_s():
                self._go_up(now_s)
        else:
            self._good_s = 0.0
        if self._good_s > LONGEST_HOLD_S:
            self._hold_s[self._at] = FIRST_HOLD_S  # what carried for so long is no rung to be wary of

    def _go_down(self, now_s: float) -> None:
        if now_s - self._climbed_s <= TRIED_S:
            self._hold_s[self._at] = min(LONGEST_HOLD_S, 2 * self._hold_s[self._at])
        self._back_to = len(self._rungs)  # this is what the link carries: from here on up with care
        self._good_s = self._late_s = 0.0
        if now_s - self._down_s > PERIOD_S + LONGEST_PERIOD_S:
            self._down_from = self._at
        self._down_s = now_s
        last = len(self._rungs) - 1
        lowest = min(last, self._at + MOST_DOWN)
        self._at = next((i for i in range(self._at + 1, lowest) if self._bytes_s_of(i) <= USABLE * self._bytes_s), lowest)

    def _bytes_s_of(self, at: int) -> float:
        rung = self._rungs[at]
        return rung.rate_hz * rung.frame_bytes(self._size, self._size_quality)

    def _go_up(self, now_s: float) -> None:
        self._at = max(self._back_to, self._at - MOST_UP) if self._climbing() else self._at - 1
        self._good_s = 0.0
        self._climbed_s = now_s

    def _climbing(self) -> bool:
        """On the way back to a rung that carried before, or at the start."""
        return self._at > self._back_to

    def _needed_s(self) -> float:
        return CLIMBING_PERIOD_S if self._climbing() else self._hold_s[self._at - 1]

    def _begin_period(self, now_s: float) -> None:
        self._period = _Period(now_s)
