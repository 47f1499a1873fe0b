"""Guards one process of a container: `python -m deixis_runtime.guard COMMAND...` as its first process.

A container engine starts again what ended, but not what hangs, and takes its time for it. So this one hears from the command
that its loop runs (as systemd does: see `manager`), kills it where it falls silent though it could run (`hang_watch`), and
starts again itself what was killed, by whomever. What ends by itself is the engine's: then it ends as that ended.
It loads nothing but the standard library, for there is one in each container.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import time
from collections.abc import Mapping

from .hang_watch import HangWatch
from .interrupts import Interrupts
from .notifications import Notifications
from .restarts import Restarts
from .watchdog import Patience

TURN_S = 0.05
STOP_TIMEOUT_S = 4.0
NAME = "the command"

Command = subprocess.Popen[bytes]


def main(argv: list[str] | None = None) -> int:
    """Run a command until it ends by itself or is killed too often; kill it where it hangs. Its exit status is ours."""
    parser = argparse.ArgumentParser(prog="python -m deixis_runtime.guard", description=main.__doc__)
    silent_s = Patience().silent_s
    parser.add_argument("--silent-s", type=float, default=silent_s, metavar="S", help="silence borne (default: %(default)s)")
    parser.add_argument("--ready-s", type=float, default=60.0, metavar="S", help="borne at its start (default: %(default)s)")
    parser.add_argument("command", nargs=argparse.REMAINDER, metavar="COMMAND...")
    given = parser.parse_args(argv)
    command = given.command[1:] if given.command[:1] == ["--"] else given.command
    if not command:
        parser.error("a command is needed")
    patience = Patience(ready_s=given.ready_s, silent_s=given.silent_s)
    with Interrupts() as interrupts, Notifications(None, given.silent_s) as heard:
        return _keep(command, heard.environment(), HangWatch(heard, patience), interrupts)


def _keep(command: list[str], environment: Mapping[str, str], watch: HangWatch, interrupts: Interrupts) -> int:
    """Run the command, again and again while it is killed; its exit status."""
    restarts = Restarts()
    while True:
        child = subprocess.Popen(command, env=environment)
        why = _watch(child, watch, interrupts)
        if interrupts.requested():
            return _stop(child)
        if child.returncode >= 0:
            return exit_status(child.returncode)
        why = why or f"killed by signal {-child.returncode}"
        verdict = restarts.after(why, time.monotonic())
        if verdict.given_up:
            _say(f"{NAME} is given up: {verdict.given_up}")
            return exit_status(child.returncode)
        _say(f"{NAME} ended ({why}); starting it again")
        if interrupts.wait(verdict.pause_s):
            return exit_status(child.returncode)


def _watch(child: Command, watch: HangWatch, interrupts: Interrupts) -> str:
    """Watch it until it ends or we are to; why it was killed, if we did that."""
    while child.poll() is None and not interrupts.wait(TURN_S):
        watch.hear()
        for why in watch.hanging({NAME: child.pid}, time.monotonic()).values():
            _say(f"{NAME} {why}; killing it")
            child.kill()
            child.wait()
            return why
    return ""


def _stop(child: Command) -> int:
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


def _say(text: str) -> None:
    print(f"deixis-guard: {text}", file=sys.stderr, flush=True)


def exit_status(returncode: int) -> int:
    """Exit status of a process that ended thus, as a shell gives it: 128 and the signal's number for one that was killed."""
    return 128 - returncode if returncode < 0 else returncode


if __name__ == "__main__":
    raise SystemExit(main())
