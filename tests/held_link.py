"""A TCP connection that can be held for a while and then gives out what it held, as a link does that was cut."""

from __future__ import annotations

import socket
import threading
import time
from typing import Self

CHUNK = 1 << 16


class HeldLink:
    """Passes on what comes to `port` to another port on loopback. Use as a context manager."""

    def __init__(self, to_port: int) -> None:
        self._to_port = to_port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listener.getsockname()[1])
        self._flows = threading.Event()
        self._flows.set()
        self._sockets: list[socket.socket] = [self._listener]

    def __enter__(self) -> Self:
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._flows.set()
        for end in self._sockets:
            end.close()

    def hold_for(self, seconds: float) -> None:
        """Let nothing through to the other port for so long; the way back stays open."""
        self._flows.clear()
        time.sleep(seconds)
        self._flows.set()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
                far = socket.create_connection(("127.0.0.1", self._to_port))
            except OSError:  # closed at the end, or nobody listens there (yet)
                return
            self._sockets += [near, far]
            threading.Thread(target=self._pass, args=(near, far, self._flows), daemon=True).start()
            threading.Thread(target=self._pass, args=(far, near, None), daemon=True).start()

    def _pass(self, source: socket.socket, target: socket.socket, flows: threading.Event | None) -> None:
        try:
            while content := source.recv(CHUNK):
                if flows is not None:
                    flows.wait()
                target.sendall(content)
        except OSError:  # one end has gone
            pass
        target.close()
