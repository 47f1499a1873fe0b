"""What the children of a supervisor tell it: that their loops run. The other end of `manager`.

A local socket and not the router's: heartbeats that came over the router said nothing of a stage while the router hung. The
kernel names the sender, so a child can speak for itself alone.
"""

from __future__ import annotations

import os
import socket
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Self

from .manager import LEAVING

DATAGRAM_BYTES = 4096
CREDENTIALS = struct.Struct("3i")  # process number, user, group: struct ucred
MOST_AT_ONCE = 1000
SIGN = b"WATCHDOG=1"


class Notifications:
    """A socket that children are told of by their environment. Use as a context manager."""

    def __init__(self, path: Path | None, silent_s: float) -> None:
        """Without a path under a free abstract name, of which nothing is left in the file system.

        `silent_s`: for how long a child may be silent; it speaks four times as often.
        """
        self._path = path
        self._silent_s = silent_s
        self._leaving: set[int] = set()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)

    def __enter__(self) -> Self:
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        self._socket.setblocking(False)
        self._socket.bind("" if self._path is None else str(self._path))
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def environment(self) -> dict[str, str]:
        """Of a child: ours, but that it has another manager than we."""
        inherited = {name: value for name, value in os.environ.items() if name != "WATCHDOG_PID"}
        return inherited | {"NOTIFY_SOCKET": self._name(), "WATCHDOG_USEC": str(round(self._silent_s * 1e6))}

    def _name(self) -> str:
        bound = self._socket.getsockname()
        return bound if isinstance(bound, str) else "@" + bound[1:].decode("ascii")

    def senders(self) -> set[int]:
        """Process numbers of those who have given a sign since the last call."""
        said = [(pid, text.split(b"\n")) for pid, text in self._datagrams()]
        self._leaving |= {pid for pid, lines in said if LEAVING in lines}
        return {pid for pid, lines in said if SIGN in lines}

    def take_leaving(self) -> set[int]:
        """Process numbers of those of the `senders` who have said since the last call that they end."""
        leaving, self._leaving = self._leaving, set()
        return leaving

    def _datagrams(self) -> Iterator[tuple[int, bytes]]:
        for _ in range(MOST_AT_ONCE):  # a child that floods us does not hold us
            try:
                text, ancillary, _, _ = self._socket.recvmsg(DATAGRAM_BYTES, socket.CMSG_SPACE(CREDENTIALS.size))
            except BlockingIOError:
                return
            for level, kind, content in ancillary:
                if (level, kind) == (socket.SOL_SOCKET, socket.SCM_CREDENTIALS):
                    yield CREDENTIALS.unpack(content[: CREDENTIALS.size])[0], text
