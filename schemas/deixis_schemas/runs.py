"""When a camera begins anew, and how time passes in between: the one notion of a run that all stages share.

A run is what the camera says it is (`OfFrame.run`). Nothing else begins one: a wall clock that is set back by some
milliseconds, as NTP does, made trackers forget everybody.
"""

from __future__ import annotations

from typing import NamedTuple


class Moment(NamedTuple):
    """Where a frame stands in time. `now_ns` never falls within a run; its zero is of no meaning."""

    new_run: bool
    now_ns: int
    elapsed_s: float


class RunClock:
    """Steady time from the `run` and `stamp_ns` of successive frames.

    Stamps are a wall clock's. Where one does not advance, the clock was set back meanwhile: as much time is taken to have
    passed as between the frames before.
    """

    def __init__(self) -> None:
        self._run: int | None = None
        self._stamp_ns = 0
        self._now_ns = 0
        self._period_ns = 0

    def advance(self, run: int, stamp_ns: int) -> Moment:
        """The next frame, of that run, captured at `stamp_ns`."""
        if run != self._run:
            self._run, self._stamp_ns, self._now_ns, self._period_ns = run, stamp_ns, stamp_ns, 0
            return Moment(True, stamp_ns, 0.0)
        passed_ns = stamp_ns - self._stamp_ns
        if passed_ns > 0:
            self._period_ns = passed_ns
        else:
            passed_ns = self._period_ns
        self._stamp_ns = stamp_ns
        self._now_ns += passed_ns
        return Moment(False, self._now_ns, passed_ns / 1e9)
