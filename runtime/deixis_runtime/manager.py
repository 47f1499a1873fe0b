"""What this process tells the one that manages it: that it is ready, that its loop runs, and how it is.

By the protocol of systemd (sd_notify): datagrams to the socket named in NOTIFY_SOCKET. `guard` hears the same in a container.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from contextlib import suppress

# Of the time that the manager bears silence, as systemd recommends at most half; a quarter bears a late turn of the loop.
SHARE = 0.25
STATUS_LENGTH = 200


class Manager:
    """Tells the manager of this process. Where there is none, nothing is sent. Times are monotonic seconds."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._address = address_of(environment.get("NOTIFY_SOCKET", ""))
        self._every_s = silence_borne_s(environment) * SHARE
        self._next_s = 0.0
        self._ready = False

    def tell(self, now_s: float, status: str = "") -> None:
        """The loop runs, and is ready from the first call on; to be called each turn, sends only when it is due.

        Raises OSError when the manager does not hear.
        """
        due = not self._ready or (self._every_s > 0.0 and now_s >= self._next_s)
        if self._address is None or not due:
            return
        self._send(message(first=not self._ready, status=status))
        self._ready, self._next_s = True, now_s + self._every_s

    def _send(self, text: bytes) -> None:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
            sender.setblocking(False)  # a manager that hangs does not hold the loop
            with suppress(BlockingIOError):  # its queue is full: it has enough of ours to read
                sender.sendto(text, self._address or "")


def message(*, first: bool, status: str) -> bytes:
    """One datagram."""
    lines = ["READY=1"] * first + ["WATCHDOG=1"]
    lines += [f"STATUS={' '.join(status.split())[:STATUS_LENGTH]}"] * bool(status)
    return "\n".join(lines).encode()


def address_of(name: str) -> str | None:
    """The address of a notification socket as its variable names it: a path, or `@` for an abstract one. None without."""
    if not name.startswith(("/", "@")):
        return None
    return f"\0{name[1:]}" if name.startswith("@") else name


def silence_borne_s(environment: Mapping[str, str]) -> float:
    """For how many seconds the manager bears silence of this process; 0 where it does not watch it."""
    text = environment.get("WATCHDOG_USEC", "")
    mine = environment.get("WATCHDOG_PID", "") in ("", str(os.getpid()))
    return int(text) / 1e6 if mine and text.isdigit() else 0.0
