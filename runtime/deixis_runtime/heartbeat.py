"""The health record of a stage: gathered in its loop, so that a hung loop shows no heartbeat."""

from __future__ import annotations

import os
import socket
import time
from collections import deque
from collections.abc import Sequence
from statistics import median

from deixis_schemas.messages import ClockHealth, Health, HealthState, Producer

from .inputs import Subscription
from .outputs import Publisher
from .versions import versions_of

PERIOD_S = 1.0
STEPS_OVER_S = 1.0


class StepTimes:
    """How long the steps of the last second took."""

    def __init__(self) -> None:
        self._steps: deque[tuple[float, float]] = deque()

    def add(self, took_s: float, now_s: float) -> None:
        """A step ended now."""
        self._steps.append((now_s, took_s * 1e3))
        self.last_second_ms(now_s)

    def last_second_ms(self, now_s: float) -> list[float]:
        """Times of the steps that ended within the last second, ms."""
        while self._steps and now_s - self._steps[0][0] > STEPS_OVER_S:
            self._steps.popleft()
        return [took_ms for _, took_ms in self._steps]


class Heartbeat:
    """Collects what the health record says."""

    def __init__(self, producer: Producer, distribution: str) -> None:
        """`distribution`: what the process is made by, whose version is said."""
        self.state: HealthState = "ok"
        self.reason = ""
        self.counters: dict[str, int] = {}
        self.notes: dict[str, str] = {}
        self._producer = producer
        self._versions = versions_of(distribution)
        self._count = 0
        self._started_s = time.monotonic()
        self._next_s = self._started_s
        self._steps = StepTimes()

    def due_in_s(self) -> float:
        """Seconds until the next record is due."""
        return max(0.0, self._next_s - time.monotonic())

    def hasten(self, within_s: float) -> None:
        """Let the next record be due by then, if it is not due before."""
        self._next_s = min(self._next_s, time.monotonic() + within_s)

    def step_took(self, seconds: float) -> None:
        """Note the time of one step."""
        self._steps.add(seconds, time.monotonic())

    def beat(self) -> None:
        """Advance the count: the loop runs."""
        self._count += 1
        self._next_s = time.monotonic() + PERIOD_S

    def record(
        self,
        now_ns: int,
        inputs: list[Subscription],
        outputs: list[Publisher],
        clocks: Sequence[ClockHealth] = (),
        router: str = "",
        *,
        standing_by: bool = False,
    ) -> Health:
        """The record as of now."""
        steps = self._steps.last_second_ms(time.monotonic())
        return Health(
            stamp_ns=now_ns,
            stage=self._producer.stage,
            instance=self._producer.instance,
            count=self._count,
            state=self.state,
            reason=self.reason[:2000],
            pid=os.getpid(),
            host=socket.gethostname(),
            router=router,
            uptime_s=round(time.monotonic() - self._started_s, 3),
            cpu_s=round(time.process_time(), 3),
            rss_mb=round(resident_mb(), 1),
            step_ms_p50=round(median(steps), 3) if steps else 0.0,
            step_ms_max=round(max(steps), 3) if steps else 0.0,
            inputs=[item.health() for item in inputs],
            outputs=[item.health() for item in outputs],
            counters=dict(self.counters),
            notes=list(self.notes.values())[:16],
            versions=self._versions,
            clocks=list(clocks),
            standing_by=standing_by,
        )


def resident_mb() -> float:
    """Resident memory of this process in MB; 0 where /proc does not tell."""
    try:
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, ValueError, IndexError):
        return 0.0
