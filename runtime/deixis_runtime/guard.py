"""Guards one process of a container: `python -m deixis_runtime.guard COMMAND...` as its first process.

A container engine starts again what ended, but not what hangs. So this one hears from the command that its loop runs (as
systemd does: see `manager`), kills it where it falls silent, and ends as it ended; the engine's restart policy does the rest.
It loads nothing but the standard library, for there is one in each container.
"""

from __future__ import annotations

import argparse
import os
import signal
import socket
import subprocess
import sys
import time

from .interrupts import Interrupts
from .watchdog import Patience, Watchdog

TURN_S = 0.1
STOP_TIMEOUT_S = 4.0
DATAGRAM_BYTES = 4096
NAME = "the command"


def main(argv: list[str] | None = None) -> int:
    """Run a command until it ends, and kill it where it hangs. The exit status is the command's."""
    parser = argparse.ArgumentParser(prog="python -m deixis_runtime.guard", description=main.__doc__)
    parser.add_argument("--silent-s", type=float, default=2.0, metavar="S", help="silence borne (default: %(default)s)")
    parser.add_argument("--ready-s", type=float, default=60.0, metavar="S", help="borne at its start (default: %(default)s)")
    parser.add_argument("command", nargs=argparse.REMAINDER, metavar="COMMAND...")
    given = parser.parse_args(argv)
    command = given.command[1:] if given.command[:1] == ["--"] else given.command
    if not command:
        parser.error("a command is needed")
    patience = Patience(ready_s=given.ready_s, silent_s=given.silent_s)
    with Interrupts() as interrupts, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as heard:
        heard.bind("")  # a free abstract name: nothing is left of it in the file system
        heard.settimeout(TURN_S)
        name = "@" + heard.getsockname()[1:].decode("ascii")
        told = {"NOTIFY_SOCKET": name, "WATCHDOG_USEC": str(round(given.silent_s * 1e6))}
        child = subprocess.Popen(command, env={**os.environ, **told})
        return _guard(child, heard, interrupts, Watchdog(patience))


def _guard(child: subprocess.Popen[bytes], heard: socket.socket, interrupts: Interrupts, watchdog: Watchdog) -> int:
    while child.poll() is None:
        if interrupts.requested():
            return _stop(child)
        if _hears(heard):
            watchdog.beat(child.pid)
        for why in watchdog.hanging({NAME: child.pid}, time.monotonic()).values():
            _say(f"{NAME} {why}; killing it")
            child.kill()
            child.wait()
    return exit_status(child.returncode)


def _stop(child: subprocess.Popen[bytes]) -> int:
    """End the command as we are ended; a stopped one sees SIGTERM after SIGCONT only."""
    child.terminate()
    child.send_signal(signal.SIGCONT)
    try:
        child.wait(STOP_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        _say(f"{NAME} does not stop; killing it")
        child.kill()
        child.wait()
    return exit_status(child.returncode)


def _hears(heard: socket.socket) -> bool:
    try:
        return b"WATCHDOG=1" in heard.recv(DATAGRAM_BYTES).split(b"\n")
    except TimeoutError:
        return False


def _say(text: str) -> None:
    print(f"deixis-guard: {text}", file=sys.stderr, flush=True)


def exit_status(returncode: int) -> int:
    """Exit status of a process that ended thus, as a shell gives it: 128 and the signal's number for one that was killed."""
    return 128 - returncode if returncode < 0 else returncode


if __name__ == "__main__":
    raise SystemExit(main())
