"""Which processes hang: judged from the signs they give that their loop runs, and from time. No clock, no I/O."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Patience:
    """How long silence is borne, seconds.

    ready_s: until the first sign of a process just started. silent_s: between signs. watched_s: at most so much of the time
    between two judgements counts, for we may have stood still ourselves. unable_s: at most so much of a silence is forgiven
    because the process could not run (other work took the processor, or a disk its time).
    """

    ready_s: float = 10.0
    silent_s: float = 0.8
    watched_s: float = 0.25
    unable_s: float = 10.0


@dataclass
class _Silence:
    """Of one process: whether it ever gave a sign, since when it is silent as far as we watched, and what is forgiven."""

    ready: bool = False
    silent_s: float = 0.0
    forgiven_s: float = 0.0


class Watchdog:
    """Hears signs and says who hangs. Times are monotonic seconds; a process is known by its process number.

    Silence is counted only while we watch: after a standstill of our own, however long, those who were healthy before it have
    nearly all their time left to give a sign. (Once, a supervisor that had stood still killed every healthy stage.)
    """

    def __init__(self, patience: Patience) -> None:
        self._patience = patience
        self._silences: dict[int, _Silence] = {}
        self._judged_s: float | None = None

    def beat(self, pid: int) -> None:
        """A sign was heard that the loop of this process runs."""
        self._silences[pid] = _Silence(ready=True)

    def suspects(self) -> list[int]:
        """Those who have been silent for half of what is borne: whether they can run at all is worth a look."""
        return [pid for pid, silence in self._silences.items() if silence.silent_s > self._limit_s(silence) / 2]

    def hanging(self, running: Mapping[str, int], now_s: float, unable_s: Mapping[int, float] | None = None) -> dict[str, str]:
        """Those of the `running` processes (pid by name) that hang, with the reason. Call it several times a second.

        `unable_s`: for how much of the time since the last call a process could not run, by process number.
        """
        watched_s = 0.0 if self._judged_s is None else min(now_s - self._judged_s, self._patience.watched_s)
        self._judged_s = now_s
        self._silences = {pid: self._silences.get(pid, _Silence()) for pid in running.values()}
        for pid, silence in self._silences.items():
            forgiven_s = min((unable_s or {}).get(pid, 0.0), watched_s, self._patience.unable_s - silence.forgiven_s)
            silence.silent_s += watched_s - forgiven_s
            silence.forgiven_s += forgiven_s
        return {name: why for name, pid in running.items() if (why := self._why(self._silences[pid]))}

    def _limit_s(self, silence: _Silence) -> float:
        return self._patience.silent_s if silence.ready else self._patience.ready_s

    def _why(self, silence: _Silence) -> str:
        limit_s = self._limit_s(silence)
        if silence.silent_s <= limit_s:
            return ""
        return f"gave no sign that its loop runs {'for' if silence.ready else 'within'} {limit_s:g} s"
