"""Processes of one host: started, watched, restarted with a limit, stopped."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import time
from collections import deque
from dataclasses import dataclass, field

from .launching import Child, start_process
from .settings import STARTED_BEFORE
from .stage import EXIT_CONFIG, EXIT_UNREACHABLE

log = logging.getLogger("deixis-supervisor")

RESTART_LIMIT = 5
RESTART_WINDOW_S = 60.0
BACKOFF_S = 0.5
BACKOFF_MAX_S = 8.0
STOP_TIMEOUT_S = 4.0
KILL_TIMEOUT_S = 1.0
SIGNALS = {number.value: number.name for number in signal.Signals}


@dataclass
class Process:
    """One child: its command and how it has fared."""

    name: str
    argv: list[str]
    popen: Child | None = None
    restarts: deque[float] = field(default_factory=lambda: deque(maxlen=RESTART_LIMIT))
    started: int = 0
    start_again_s: float | None = None
    given_up: str = ""

    @property
    def running(self) -> bool:
        """Whether the child runs now."""
        return self.popen is not None and self.popen.poll() is None


class Supervisor:
    """Holds the children. `poll` has to be called a few times a second."""

    def __init__(self) -> None:
        self.processes: dict[str, Process] = {}
        self.launch = start_process

    def start(self, name: str, argv: list[str]) -> None:
        """Start a child. It gets its own session, so that Ctrl-C reaches the supervisor alone, which stops them in order."""
        process = self.processes[name] = Process(name, argv)
        self._spawn(process)

    def poll(self) -> None:
        """Notice children that ended and start them again, with a growing pause and a limit."""
        for process in self.processes.values():
            if process.given_up or process.running:
                continue
            if process.start_again_s is None:
                self._plan_restart(process)
            elif time.monotonic() >= process.start_again_s:
                self._spawn(process)

    def kill(self, name: str, why: str) -> None:
        """End a child that hangs; `poll` starts it again."""
        process = self.processes[name]
        if process.popen is not None and process.running:
            log.error("%s %s; killing it", name, why)
            process.popen.kill()

    def failed(self) -> dict[str, str]:
        """Children given up, with the reason."""
        return {process.name: process.given_up for process in self.processes.values() if process.given_up}

    def stop(self) -> None:
        """Stop all children: SIGTERM in reverse order of their start, SIGKILL for those that stay."""
        for process in reversed(self.processes.values()):
            if process.popen is not None and process.running:
                # A stopped process (SIGSTOP) would not see SIGTERM.
                process.popen.send_signal(signal.SIGTERM)
                process.popen.send_signal(signal.SIGCONT)
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
        environment = {**os.environ, STARTED_BEFORE: str(process.started)}
        process.started += 1
        try:
            process.popen = self.launch(process.argv, environment)
        except OSError as error:
            process.given_up = f"it cannot be started: {error.strerror}"
            log.error("%s is given up: %s", process.name, process.given_up)

    def _plan_restart(self, process: Process) -> None:
        assert process.popen is not None
        status, now = process.popen.poll(), time.monotonic()
        assert status is not None
        if status == EXIT_CONFIG:
            process.given_up = "its settings are wrong"
        elif len(process.restarts) == RESTART_LIMIT and now - process.restarts[0] < RESTART_WINDOW_S:
            ends, last = RESTART_LIMIT + 1, say_status(status)
            process.given_up = f"it ended {ends} times within {RESTART_WINDOW_S:.0f} s, the last time by {last}"
        if process.given_up:
            log.error("%s is given up: %s", process.name, process.given_up)
            return
        pause = min(BACKOFF_MAX_S, BACKOFF_S * 2 ** sum(now - at < RESTART_WINDOW_S for at in process.restarts))
        process.restarts.append(now)
        process.start_again_s = now + pause
        log.warning("%s ended (%s); starting it again in %.1f s", process.name, say_status(status), pause)


def say_status(status: int) -> str:
    """An exit status in words."""
    if status < 0:
        return f"killed by {SIGNALS.get(-status, f'signal {-status}')}"
    if status == EXIT_UNREACHABLE:
        return "no router, or its endpoint is taken"
    return f"status {status}"
