"""Processes that a supervisor starts to take the place of its own stages, and what becomes of the two of a place afterwards."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from typing import Any

from deixis_schemas import topics

from .launching import start_process
from .queries import Refused
from .supervisor import Process, Supervisor

log = logging.getLogger("deixis-supervisor")

STANDS_BY_S = 60.0
"""So long a newcomer stands by for a swap that nobody orders."""
GONE_S = 0.5
"""A place that nobody has had for so long is free: who has it may itself be on the point of starting again."""
MAX_SETS = 32
MAX_SET_LENGTH = 500


def newcomer_of(stage: str) -> str:
    """The name under which the supervisor has a stage's newcomer."""
    return f"{stage} newcomer"


class Newcomers:
    """Of one host. `command` gives the command line of a stage, `instance` the name of its process with that number."""

    def __init__(self, supervisor: Supervisor, command: Callable[[str], list[str]], instance: Callable[[int], str]) -> None:
        self._supervisor = supervisor
        self._command = command
        self._instance = instance
        self._commands: dict[str, list[str]] = {}
        self._free_since_s: dict[str, float] = {}

    def start(self, stage: str, sets: tuple[str, ...], router: str) -> str:
        """Start a second process of a stage of ours, with settings that come last; its instance. Raises Refused.

        Not forked: what is installed by now is what it runs.
        """
        incumbent = self._supervisor.processes.get(stage)
        if stage not in topics.SWAPPABLE or incumbent is None:
            raise Refused(f"stage: '{stage[:80]}' is not started here")
        if not incumbent.running:
            raise Refused(f"stage: {stage} is not running here{' ' + incumbent.given_up if incumbent.given_up else ''}")
        before = self._supervisor.processes.get(newcomer_of(stage))
        if before is not None and before.running:
            raise Refused(f"stage: a newcomer of {stage} stands by already, process {before.popen.pid if before.popen else 0}")
        if before is not None:
            self._supervisor.drop(newcomer_of(stage))
        command = [*self._command(stage), *(word for item in sets for word in ("--set", item))]
        self._commands[stage] = command
        self._supervisor.start(newcomer_of(stage), [*command, "--stand-by"], needs=router, once=True, launch=start_process)
        return self.instance(stage)

    def stop(self, stage: str, alive: set[tuple[str, str]]) -> str:
        """End the newcomer of a stage, unless it is heard; its instance. Raises Refused."""
        instance = self.instance(stage)
        if (stage, instance) in alive:
            raise Refused(f"{stage}/{instance} has the place by now")
        self._supervisor.drop(newcomer_of(stage))
        return instance

    def instance(self, stage: str) -> str:
        """The instance of the newcomer of a stage. Raises Refused where there is none, or it has ended."""
        process = self._supervisor.processes.get(newcomer_of(stage))
        if process is None or process.popen is None:
            raise Refused(f"stage: there is no newcomer of {stage[:80]}")
        if not process.running:
            ended = process.last_end or process.killed_for or "just now"
            raise Refused(f"{ended}; its message stands in the supervisor's log")
        return self._instance(process.popen.pid)

    def look(self, alive: set[tuple[str, str]], now_s: float) -> None:
        """Settle the places by who is heard, (stage, instance): call it several times a second."""
        for process in list(self._supervisor.processes.values()):
            if process.once:
                self._look_at_newcomer(process, alive, now_s)
            elif process.replaced:
                self._look_at_place(process, alive, now_s)

    def _look_at_newcomer(self, process: Process, alive: set[tuple[str, str]], now_s: float) -> None:
        stage = next(stage for stage in self._commands if newcomer_of(stage) == process.name)
        spare = process.running and process.popen is not None and (stage, self._instance(process.popen.pid)) not in alive
        if spare and now_s - process.started_s > STANDS_BY_S:
            log.warning("%s was not given the place within %.0f s; stopping it", process.name, STANDS_BY_S)
            self._supervisor.drop(process.name)

    def _look_at_place(self, process: Process, alive: set[tuple[str, str]], now_s: float) -> None:
        stage = process.name
        newcomer = self._supervisor.processes.get(newcomer_of(stage))
        if newcomer is not None and newcomer.running:
            self._supervisor.adopt(newcomer.name, stage, self._commands.pop(stage))
            log.info("%s: its newcomer has the place", stage)
            return
        if any(name == stage for name, _ in alive):
            self._free_since_s.pop(stage, None)
            return
        if now_s - self._free_since_s.setdefault(stage, now_s) >= GONE_S:
            del self._free_since_s[stage]
            log.warning("%s: who had its place is gone; starting it again", stage)
            self._supervisor.start_again(stage)


def settings_of(payload: bytes | None) -> tuple[str, ...]:
    """Settings, NAME=VALUE, as the payload of a get: a JSON list of texts, none without a payload. Raises Refused."""
    if not payload:
        return ()
    try:
        told: Any = json.loads(payload)
    except (ValueError, RecursionError):
        raise Refused("payload: not JSON") from None
    good = isinstance(told, list) and all(isinstance(item, str) and len(item) <= MAX_SET_LENGTH for item in told)
    if not good or len(told) > MAX_SETS:
        raise Refused(f"payload: no list of {MAX_SETS} texts at most, of {MAX_SET_LENGTH} characters at most")
    return tuple(told)
