"""Watches the stages and the router that systemd runs on this host: `python -m deixis_runtime.watchman --socket PATH`.

systemd starts again what ends. Of what hangs it hears by silence alone, and so needs patience (`WatchdogSec`): it cannot tell a
process that hangs from one that a busy machine keeps from running. This one can, for it looks (`hang_watch`), as the supervisor
of `deixis up` does; what hangs it kills, and systemd does the rest. Without it systemd's patience remains.

Who gives a sign on the socket is watched from then on; starts are systemd's. It loads nothing but the standard library.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Self

from .hang_watch import HangWatch
from .interrupts import Interrupts
from .manager import Manager, Unheard
from .notifications import Notifications
from .watchdog import Patience

TURN_S = 0.05


class Watchman:
    """Kills who hangs of those who gave a sign. Use as a context manager; times are monotonic seconds."""

    def __init__(self, watch: HangWatch) -> None:
        self._watch = watch
        self._handles: dict[int, int] = {}  # by process number: of the process itself, for numbers are used again

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for pid in list(self._handles):
            self._forget(pid)

    def turn(self, now_s: float) -> Iterator[str]:
        """Look once, several times a second; gives what there is to say."""
        for pid in self._watch.hear() - self._handles.keys():
            self._meet(pid)
        for pid in self._watch.take_leaving() & self._handles.keys():
            self._forget(pid)
        ended, _, _ = select.select(list(self._handles.values()), [], [], 0)
        for pid in [pid for pid, handle in self._handles.items() if handle in ended]:
            self._forget(pid)
        for name, why in self._watch.hanging({str(pid): pid for pid in self._handles}, now_s).items():
            yield self._kill(int(name), why)

    def _meet(self, pid: int) -> None:
        try:
            self._handles[pid] = os.pidfd_open(pid)
        except ProcessLookupError:
            return  # it spoke and ended

    def _forget(self, pid: int) -> None:
        os.close(self._handles.pop(pid))

    def _kill(self, pid: int, why: str) -> str:
        called, handle = name_of(pid), self._handles[pid]
        try:
            signal.pidfd_send_signal(handle, signal.SIGKILL)
        except ProcessLookupError:
            return f"{called} {why}, and has ended"
        except PermissionError:
            return f"{called} {why}; it is another user's and cannot be killed from here"
        finally:
            self._forget(pid)
        return f"{called} {why}; killed"


def name_of(pid: int) -> str:
    """What runs under this number, in a word or two: its command and its number."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode("utf-8", "replace").rstrip("\0").split("\0")
    except OSError:
        return f"process {pid}"
    ours = [name for word in words if (name := Path(word).name).startswith("deixis")]
    return f"{(ours or [Path(words[0]).name])[0]} (process {pid})"


def main(argv: list[str] | None = None) -> int:
    """Watch until told to stop. Exit status 1 where the socket cannot be made."""
    parser = argparse.ArgumentParser(prog="python -m deixis_runtime.watchman", description=main.__doc__)
    parser.add_argument("--socket", type=Path, required=True, metavar="PATH", help="where signs are given; made anew")
    given = parser.parse_args(argv)
    patience, manager = Patience(), Manager(os.environ)
    given.socket.unlink(missing_ok=True)  # of one that was killed
    with Interrupts() as interrupts:
        try:
            with Notifications(given.socket, patience.silent_s) as heard, Watchman(HangWatch(heard, patience)) as watchman:
                while not interrupts.wait(TURN_S):
                    for said in watchman.turn(time.monotonic()):
                        _say(said)
                    manager.tell(time.monotonic())
        except Unheard as error:
            _say(str(error))
            return 1
        except OSError as error:
            _say(f"{given.socket}: {error.strerror}")
            return 1
    given.socket.unlink(missing_ok=True)
    return 0


def _say(text: str) -> None:
    print(f"deixis-watchman: {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
