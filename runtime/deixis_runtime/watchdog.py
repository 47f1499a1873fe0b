"""Which processes hang: judged from heartbeats, from the link they come over, and from time. No clock, no I/O."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Patience:
    """How long silence is borne, seconds.

    ready_s: until the first heartbeat, of a process just started and of all after silence that was not theirs. silent_s:
    between heartbeats. blind_s: a pause between two judgements from which on we ourselves stood still.
    """

    ready_s: float = 30.0
    silent_s: float = 6.0
    blind_s: float = 3.0


class Watchdog:
    """Hears heartbeats and says who hangs. Times are monotonic seconds; a process is known by its process number.

    While the link is down, or while we stood still ourselves, silence says nothing of the stages: nobody is judged, and then
    all have the time of a fresh start to beat again. (Once, a crash of the router had every healthy stage killed that was
    older than that.)
    """

    def __init__(self, patience: Patience) -> None:
        self._patience = patience
        self._beats: dict[int, tuple[int, float]] = {}
        self._awaited_s: dict[int, float] = {}
        self._link: str | None = None
        self._judged_s: float | None = None

    def beat(self, pid: int, count: int, at_s: float) -> None:
        """A heartbeat was heard. One whose `count` does not advance comes from a loop that stands."""
        last = self._beats.get(pid)
        if last is None or count != last[0]:
            self._beats[pid] = (count, at_s)

    def hanging(self, running: Mapping[str, int], link: str | None, now_s: float) -> dict[str, str]:
        """Those of the `running` processes (pid by name) that hang, with the reason. Call it a few times a second.

        `link` names the router that heartbeats come through: another name is another link; None while there is none.
        """
        stood_still = self._judged_s is not None and now_s - self._judged_s > self._patience.blind_s
        if link is None or link != self._link or stood_still:
            self._begin_anew()
        self._link, self._judged_s = link, now_s
        self._beats = {pid: beat for pid, beat in self._beats.items() if pid in running.values()}
        self._awaited_s = {pid: self._awaited_s.get(pid, now_s) for pid in running.values()}
        if link is None:
            return {}
        return {name: why for name, pid in running.items() if (why := self._why(pid, now_s))}

    def _begin_anew(self) -> None:
        self._beats.clear()
        self._awaited_s.clear()

    def _why(self, pid: int, now_s: float) -> str:
        beat, patience = self._beats.get(pid), self._patience
        if beat is None:
            late = now_s - self._awaited_s[pid] > patience.ready_s
            return f"gave no heartbeat within {patience.ready_s:g} s of its start, or of the link's" if late else ""
        return f"gives no heartbeat for {patience.silent_s:g} s" if now_s - beat[1] > patience.silent_s else ""
