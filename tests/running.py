"""Runs real Deixis processes for a test, and asks them things over Zenoh."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh
from deixis_runtime.session import Unreachable, open_client

ROOT = Path(__file__).parents[1]
CLIP = ROOT / "examples" / "pointing.mp4"
SITE = ROOT / "examples" / "pointing.yaml"
POINTED_AT = "P3"
SMALL_CLIP = ROOT / "examples" / "clips" / "small.mp4"
"""Half the size at half the rate, which costs a quarter; it fits the same site."""
SMALL_POINTED_AT = "P7"
BIN = Path(sys.executable).parent
START_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 15.0


@contextmanager
def process(argv: Sequence[object], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process that writes to `log`, told to stop at the end and killed where it does not."""
    with log.open("ab") as file:
        child = subprocess.Popen([*map(str, argv)], stdin=subprocess.DEVNULL, stdout=file, stderr=file)
    try:
        yield child
    finally:
        child.send_signal(signal.SIGTERM)
        try:
            child.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def command(name: str, *arguments: object) -> list[str]:
    """A console script of the project's environment, e.g. `command("deixis", "status")`."""
    return [str(BIN / name), *map(str, arguments)]


@dataclass(frozen=True)
class System:
    """A running system: its robot, its router's endpoint, a session of ours, its process and its log."""

    robot: str
    endpoint: str
    session: zenoh.Session
    child: subprocess.Popen[bytes]
    log: Path

    def key(self, path: str) -> str:
        """A key of this robot."""
        return f"deixis/{self.robot}/{path}"

    def state(self) -> dict[str, Any]:
        """fusion/state; empty while fusion does not answer."""
        return get_one(self.session, self.key("fusion/state")) or {}

    def health(self, stage: str) -> dict[str, Any]:
        """Health of a stage; empty while it does not answer."""
        return get_one(self.session, self.key(f"{stage}/health")) or {}

    def wait_until(self, condition: Callable[[], Any], what: str, timeout_s: float = 30.0) -> Any:
        """The condition's first true value; fails with the end of the log, at once when the process has ended."""

        def checked() -> Any:
            assert self.child.poll() is None, f"ended with {self.child.returncode}:\n{tail(self.log)}"
            return condition()

        return wait_until(checked, what, timeout_s, self.log)


@contextmanager
def system(folder: Path, robot: str, *arguments: object, clip: Path = SMALL_CLIP) -> Iterator[System]:
    """`deixis run` on a clip that fits the site, again and again, with these arguments; registry and log lie in `folder`.

    In lockstep, so that a busy machine plays it slowly and drops nothing.
    """
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    options = ["--site", SITE, "--loop", "--lockstep", "--robot", robot, "--listen", endpoint]
    options += ["--registry", folder / "pois.sqlite"]
    log = folder / "log"
    with process(command("deixis", "run", clip, *options, *arguments), log) as child:
        wait_until(lambda: child.poll() is not None or answers(endpoint), "a router", START_TIMEOUT_S, log)
        assert child.poll() is None, tail(log)
        with open_client(endpoint, shared_memory=False) as session:
            yield System(robot, endpoint, session, child, log)


def children(pid: int) -> list[int]:
    """Process numbers of the children of a process."""
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def child_called(pid: int, word: str) -> int | None:
    """The child that has the word in its command line, e.g. `deixis-camera` or `deixis_runtime.router`; None without one."""
    for child in children(pid):
        with suppress(FileNotFoundError):  # it has just ended
            if word.encode() in Path(f"/proc/{child}/cmdline").read_bytes():
                return child
    return None


def answers(endpoint: str) -> bool:
    """Whether a router answers at the endpoint."""
    with suppress(Unreachable), open_client(endpoint, shared_memory=False):
        return True
    return False


def free_port() -> int:
    """A TCP port on loopback that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def get_json(session: zenoh.Session, key: str, timeout_s: float = 2.0) -> list[dict[str, Any]]:
    """The JSON answers to a get, none when nobody answers in time. Fails on an error reply."""
    separator = ";" if "?" in key else "?"
    answers = []
    for reply in session.get(f"{key}{separator}format=json", timeout=timeout_s):
        if reply.err is not None and reply.err.payload.to_string() == "Timeout":
            continue
        assert reply.ok is not None, f"{key}: {reply.err.payload.to_string() if reply.err else 'no answer'}"
        answers.append(json.loads(reply.ok.payload.to_bytes()))
    return answers


def get_one(session: zenoh.Session, key: str, timeout_s: float = 2.0) -> dict[str, Any] | None:
    """The first answer of `get_json`; None when nobody answers."""
    answers = get_json(session, key, timeout_s)
    return answers[0] if answers else None


def wait_until(condition: Callable[[], Any], what: str, timeout_s: float, log: Path | None = None) -> Any:
    """The condition's first true value; AssertionError with the end of `log` when it does not come."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError(f"not within {timeout_s:.0f} s: {what}\n{tail(log) if log else ''}")


def tail(log: Path) -> str:
    """The end of a log."""
    return log.read_text(errors="replace")[-3000:]
