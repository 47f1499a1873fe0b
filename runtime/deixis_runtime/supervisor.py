"""Processes of one host: started, restarted with a limit, stopped."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from .launching import Child, start_process
from .restarts import Restarts
from .settings import STARTED_BEFORE
from .stage import EXIT_CONFIG, EXIT_REPLACED, EXIT_UNREACHABLE

log = logging.getLogger("deixis-supervisor")

STOP_TIMEOUT_S = 1.2
KILL_TIMEOUT_S = 0.5
SETTLED_S = 15.0  # longer than a start may take: who hangs in it is ended by then
SIGNALS = {number.value: number.name for number in signal.Signals}


Launch = Callable[[Sequence[str], Mapping[str, str]], Child]


@dataclass
class Process:
    """One child: its command and how it has fared.

    needs: the one without which it cannot start. started: how often, of which all but the first were restarts. last_end: why it
    ended last, in words, and ended_s when; killed_for: why we have killed it. given_up: why it is not started again; once: it
    is not, however it ends; replaced: another process has its place, and it is started again when that is gone (`start_again`).
    launch: how it is started, if not as all others.
    """

    name: str
    argv: list[str]
    needs: str | None = None
    popen: Child | None = None
    restarts: Restarts = field(default_factory=Restarts)
    started: int = 0
    started_s: float = 0.0
    start_again_s: float | None = None
    killed_for: str = ""
    last_end: str = ""
    ended_s: float = 0.0
    given_up: str = ""
    once: bool = False
    replaced: bool = False
    launch: Launch | None = None

    @property
    def running(self) -> bool:
        """Whether the child runs now."""
        return self.popen is not None and self.popen.poll() is None


class Supervisor:
    """Holds the children. `poll` has to be called several times a second."""

    def __init__(self) -> None:
        self.processes: dict[str, Process] = {}
        self.environment: Mapping[str, str] = os.environ
        self.launch: Launch = start_process

    def start(
        self, name: str, argv: list[str], needs: str | None = None, *, once: bool = False, launch: Launch | None = None
    ) -> None:
        """Start a child. It gets its own session, so that Ctrl-C reaches the supervisor alone, which stops them in order."""
        process = self.processes[name] = Process(name, argv, needs, once=once, launch=launch)
        self._spawn(process)

    def poll(self) -> None:
        """Notice children that ended and start them again, after a pause and with a limit: see `restarts`."""
        now_s = time.monotonic()
        for process in self.processes.values():
            if process.given_up or process.running or process.replaced or (process.once and process.last_end):
                continue
            if process.start_again_s is None:
                self._plan_restart(process, now_s)
            if process.start_again_s is not None and now_s >= process.start_again_s:
                self._spawn(process)

    def start_again(self, name: str) -> None:
        """Start a child again whose place another had."""
        process = self.processes[name]
        process.replaced = False
        self._spawn(process)

    def adopt(self, newcomer: str, name: str, argv: list[str]) -> None:
        """Let a child that was started once take the name of the one whose place it has; this command starts it again."""
        process = self.processes.pop(newcomer)
        process.name, process.argv, process.once = name, argv, False
        process.needs = self.processes[name].needs
        self.processes[name] = process

    def drop(self, name: str) -> None:
        """Forget a child that was started once, ending it where it still runs."""
        process = self.processes.pop(name)
        if process.popen is not None and process.running:
            process.popen.send_signal(signal.SIGTERM)
            process.popen.send_signal(signal.SIGCONT)
            self._await_end(process, time.monotonic() + STOP_TIMEOUT_S)

    def running(self) -> dict[str, int]:
        """Process numbers by name of the children that run now."""
        return {process.name: process.popen.pid for process in self.processes.values() if process.popen and process.running}

    def kill(self, name: str, why: str) -> None:
        """End a child that hangs; `poll` starts it again."""
        process = self.processes[name]
        if process.popen is not None and process.running:
            log.error("%s %s; killing it", name, why)
            process.killed_for = why
            process.popen.kill()
            self._await_killed(process.popen, name)

    def failed(self) -> dict[str, str]:
        """Children given up, with the reason."""
        return {process.name: process.given_up for process in self.processes.values() if process.given_up}

    def tell_to_stop(self) -> None:
        """Send SIGTERM to all children, in reverse order of their start; `stop` waits for them."""
        for process in reversed(self.processes.values()):
            if process.popen is not None and process.running:
                # A stopped process (SIGSTOP) would not see SIGTERM.
                process.popen.send_signal(signal.SIGTERM)
                process.popen.send_signal(signal.SIGCONT)

    def stop(self) -> None:
        """Stop all children: SIGTERM, and SIGKILL for those that stay."""
        self.tell_to_stop()
        deadline = time.monotonic() + STOP_TIMEOUT_S
        for process in reversed(self.processes.values()):
            self._await_end(process, deadline)

    def _await_end(self, process: Process, deadline: float) -> None:
        if process.popen is None:
            return
        try:
            process.popen.wait(max(0.05, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            log.warning("%s does not stop; killing it", process.name)
            process.popen.kill()
            self._await_killed(process.popen, process.name)

    def _await_killed(self, popen: Child, name: str) -> None:
        try:
            popen.wait(KILL_TIMEOUT_S)
        except subprocess.TimeoutExpired:  # within a system call that does not return, as of a broken device
            log.error("%s (process %d) cannot be killed; it is left behind", name, popen.pid)

    def _spawn(self, process: Process) -> None:
        process.start_again_s = None
        environment = {**self.environment, STARTED_BEFORE: str(process.started)}
        process.started += 1
        process.started_s = time.monotonic()
        try:
            process.popen = (process.launch or self.launch)(process.argv, environment)
        except OSError as error:
            process.given_up = f"it cannot be started: {error.strerror}"
            log.error("%s is given up: %s", process.name, process.given_up)

    def _plan_restart(self, process: Process, now_s: float) -> None:
        assert process.popen is not None
        status = process.popen.poll()
        assert status is not None
        process.last_end, process.ended_s = process.killed_for or say_status(status), now_s
        process.killed_for = ""
        if status == EXIT_REPLACED and not process.once:
            process.replaced = True
            log.warning("%s was replaced by another process; it is started again when that is gone", process.name)
            return
        if process.once:
            log.warning("%s ended (%s)", process.name, process.last_end)
            return
        if status == EXIT_CONFIG:
            process.given_up = "its settings are wrong"
        else:
            blameless = status == EXIT_UNREACHABLE and not self._settled(process.needs, now_s)
            verdict = process.restarts.after(process.last_end, now_s, blameless=blameless)
            process.given_up = verdict.given_up
        if process.given_up:
            log.error("%s is given up: %s", process.name, process.given_up)
            return
        process.start_again_s = now_s + verdict.pause_s
        when = f"in {verdict.pause_s:.1f} s" if verdict.pause_s else "at once"
        log.warning("%s ended (%s); starting it again %s", process.name, process.last_end, when)

    def _settled(self, name: str | None, now_s: float) -> bool:
        """Whether that child has run for a while: who does not reach it then has itself to blame."""
        process = self.processes.get(name or "")
        return process is None or (process.running and now_s - process.started_s > SETTLED_S)


def say_status(status: int) -> str:
    """An exit status in words."""
    if status < 0:
        return f"killed by {SIGNALS.get(-status, f'signal {-status}')}"
    if status == EXIT_UNREACHABLE:
        return "no router, or its endpoint is taken"
    if status == EXIT_REPLACED:
        return "replaced by another process"
    return f"status {status}"
