"""What this process tells those who manage it: that it is ready, that its loop runs, and how it is.

By the protocol of systemd (sd_notify): datagrams to the socket named in NOTIFY_SOCKET. `guard` hears the same in a container.
Under systemd there is a second one to hear it, more often: the `watchman`, by its socket in DEIXIS_WATCHMAN.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from contextlib import suppress

from .watchdog import Patience

NOTIFIED, WATCHMAN = "NOTIFY_SOCKET", "DEIXIS_WATCHMAN"
# Of the time that the manager bears silence, as systemd recommends at most half; a quarter bears a late turn of the loop.
SHARE = 0.25
STATUS_LENGTH = 200
LEAVING = b"STOPPING=1"


class Unheard(Exception):
    """A manager that the environment names is not there."""


class Manager:
    """Tells the managers of this process. Where there is none, nothing is sent. Times are monotonic seconds."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._listeners = [
            _Listener(NOTIFIED, environment, silence_borne_s(environment) * SHARE),
            _Listener(WATCHMAN, environment, Patience().silent_s * SHARE),
        ]

    def tell(self, now_s: float, status: str = "") -> None:
        """The loop runs, and is ready from the first call on; to be called each turn, sends only when it is due.

        Raises Unheard, with the variable that names who does not hear; the others have heard it then.
        """
        unheard = [why for listener in self._listeners if (why := listener.tell(now_s, status))]
        if unheard:
            raise Unheard("; ".join(unheard))

    def leave(self) -> None:
        """The loop ends in good order, which may take seconds: the watchman is told so, and then nobody anything."""
        for listener in self._listeners:
            listener.leave()


class _Listener:
    """One who is told every so many seconds; only once, that we are ready, where that is 0."""

    def __init__(self, variable: str, environment: Mapping[str, str], every_s: float) -> None:
        self._variable = variable
        self._address = address_of(environment.get(variable, ""))
        self._every_s = every_s
        self._next_s = 0.0
        self._ready = False

    def tell(self, now_s: float, status: str) -> str:
        """Send what is due. Gives why it was not heard; empty if it was, or was not due."""
        due = not self._ready or (self._every_s > 0.0 and now_s >= self._next_s)
        if self._address is None or not due:
            return ""
        try:
            self._send(message(first=not self._ready, status=status))
        except OSError as error:
            return f"{self._variable}: nobody hears that this process is alive: {error.strerror}"
        self._ready, self._next_s = True, now_s + self._every_s
        return ""

    def leave(self) -> None:
        """Tell the watchman, who then waits no more for signs. systemd knows, for it has asked, or sees the end."""
        if self._address is not None and self._variable == WATCHMAN:
            with suppress(OSError):  # it is gone, and so waits for nothing
                self._send(LEAVING)
        self._address = None

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
