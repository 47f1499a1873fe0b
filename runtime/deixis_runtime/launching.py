"""Starts the processes of a host: forked from a process that has done their imports where that can be, else from nothing."""

from __future__ import annotations

import ctypes
import json
import logging
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

from .environment import ENVIRONMENT

log = logging.getLogger("deixis-supervisor")

IMPORTS_WITHIN_S = 60.0
"""Usually half a second; on a machine that is overloaded tens of them."""
FORKS_WITHIN_S = 1.0
STOP_POLL_S = 0.1
MAX_ANSWER = 1 << 16
PR_SET_CHILD_SUBREAPER = 36


class Child(Protocol):
    """What the supervisor asks of a process it has started; `subprocess.Popen` is one."""

    pid: int
    returncode: int | None

    def poll(self) -> int | None:
        """Its status where it has ended."""

    def wait(self, timeout: float | None = None) -> int:
        """Its status when it ends. Raises subprocess.TimeoutExpired."""

    def send_signal(self, sig: int) -> None:
        """Signal it, unless it has ended."""

    def kill(self) -> None:
        """End it at once."""


def start_process(argv: Sequence[str], environment: Mapping[str, str]) -> Child:
    """A process from nothing. Raises OSError.

    It gets its own process group, so that Ctrl-C reaches the supervisor alone; and no session of its own, for then the kernel
    continues one that was stopped when its supervisor has been killed.
    """
    return subprocess.Popen(list(argv), stdin=subprocess.DEVNULL, process_group=0, env={**ENVIRONMENT, **environment})


class ForkedChild:
    """A process that another one forked for us and that is our child now."""

    def __init__(self, pid: int, argv: Sequence[str]) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._argv = list(argv)
        self._pidfd = os.pidfd_open(pid)

    def poll(self) -> int | None:
        """Its status where it has ended, negative where a signal ended it."""
        if self.returncode is None:
            ended, status = os.waitpid(self.pid, os.WNOHANG)
            if ended:
                self.returncode = os.waitstatus_to_exitcode(status)
                os.close(self._pidfd)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Its status when it ends. Raises subprocess.TimeoutExpired."""
        if self.poll() is None and not select.select([self._pidfd], [], [], timeout)[0]:
            raise subprocess.TimeoutExpired(self._argv, timeout or 0.0)
        status = self.poll()
        assert status is not None, "a process whose descriptor is readable has ended"
        return status

    def send_signal(self, sig: int) -> None:
        """Signal it, unless it has ended."""
        if self.poll() is None:
            signal.pidfd_send_signal(self._pidfd, sig)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)


@dataclass(frozen=True)
class Forkable:
    """A command that may be forked: how its command line begins, and what to call, `module:function`, with the rest."""

    begins: tuple[str, ...]
    target: str


class ForkServer:
    """The process that forks, and what may be asked of it. Use as a context manager; `start` starts children.

    What it cannot fork is started from nothing, as is all after it has died or hung: it saves memory and time, and nothing
    depends on it.
    """

    def __init__(self, forkables: Sequence[Forkable], stopped: Callable[[], bool] = lambda: False) -> None:
        """`stopped` says whether to give up waiting for its imports."""
        self._forkables = forkables
        self._stopped = stopped
        self._process: subprocess.Popen[bytes] | None = None
        self._asked: socket.socket | None = None
        self._loaded: frozenset[str] = frozenset()

    def __enter__(self) -> Self:
        if not self._forkables or not _adopt_orphans():
            return self
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        argv = [sys.executable, "-m", "deixis_runtime.forkserver"]
        environment = {**ENVIRONMENT, **os.environ}
        with theirs:
            self._asked = ours
            try:
                self._process = subprocess.Popen(argv, stdin=theirs.fileno(), process_group=0, env=environment)
                ours.send(json.dumps([item.target for item in self._forkables]).encode())
                answer = self._answer(IMPORTS_WITHIN_S)
            except (OSError, ValueError) as error:
                self._give_up(error)
                return self
        self._loaded = frozenset(answer["loaded"])
        for target, why in answer["failed"].items():
            log.info("%s is not forked: %s", target, why)
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    @property
    def targets(self) -> frozenset[str]:
        """What is forked; the rest is started from nothing."""
        return self._loaded if self._asked else frozenset()

    @property
    def pid(self) -> int | None:
        """Of the process that forks, while it is in use."""
        return self._process.pid if self._process else None

    def start(self, argv: Sequence[str], environment: Mapping[str, str]) -> Child:
        """A child with this command line and environment. Raises OSError where it cannot be started from nothing either."""
        forkable = next((item for item in self._forkables if tuple(argv[: len(item.begins)]) == item.begins), None)
        if self._asked is None or forkable is None or forkable.target not in self.targets:
            return start_process(argv, environment)
        request = {
            "target": forkable.target,
            "argv": list(argv),
            "skipped": len(forkable.begins),
            "environment": dict(environment),
        }
        waits, go = os.pipe()
        try:
            socket.send_fds(self._asked, [json.dumps(request).encode()], [waits])
            child = ForkedChild(self._answer(FORKS_WITHIN_S)["pid"], argv)
            os.write(go, b"!")
            return child
        except (OSError, ValueError) as error:
            self._give_up(error)
            return start_process(argv, environment)
        finally:
            os.close(waits)
            os.close(go)

    def _answer(self, within_s: float) -> dict[str, Any]:
        """Raises OSError or ValueError where there is none."""
        assert self._asked is not None
        deadline_s = time.monotonic() + within_s
        while not select.select([self._asked], [], [], STOP_POLL_S)[0]:
            if self._stopped():
                raise ValueError("stopped meanwhile")
            if time.monotonic() > deadline_s:
                raise ValueError(f"no answer within {within_s:g} s")
        packed = self._asked.recv(MAX_ANSWER)
        if not packed:
            raise ValueError("it has ended")
        answer = json.loads(packed)
        if not isinstance(answer, dict):
            raise ValueError("no map")
        return answer

    def _give_up(self, error: Exception) -> None:
        log.warning("the process that forks stages is not used any more (%s); they are started from nothing", error)
        self._close()

    def _close(self) -> None:
        if self._asked is not None:
            self._asked.close()
            self._asked = None
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


def _adopt_orphans() -> bool:
    """Become the parent of what our children leave behind; False where that cannot be (before Linux 3.4, other systems)."""
    prctl = getattr(ctypes.CDLL(None, use_errno=True), "prctl", None)
    return prctl is not None and prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0
