"""Ctrl-C and SIGTERM as a flag that loops look at, so that nothing is torn apart halfway."""

from __future__ import annotations

import signal
import threading
import time
from types import FrameType
from typing import Any, Self

SIGNALS = (signal.SIGINT, signal.SIGTERM)
POLL_S = 0.1


class Interrupts:
    """While entered, SIGINT and SIGTERM only set `signal`. Elsewhere than in the main thread it changes nothing.

    A handler runs between two instructions of whatever the main thread does: `threading.Event.set` in it deadlocks where that
    was waiting for the same event and held its lock. So there is a plain attribute, and waits that look at it.
    """

    def __init__(self) -> None:
        self.signal: int | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in SIGNALS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def requested(self) -> bool:
        """Whether somebody asked us to stop."""
        return self.signal is not None

    def wait(self, timeout_s: float) -> bool:
        """Wait at most `timeout_s`; whether somebody asked us to stop."""
        deadline_s = time.monotonic() + timeout_s
        while not self.requested() and (left_s := deadline_s - time.monotonic()) > 0:
            time.sleep(min(left_s, POLL_S))
        return self.requested()

    def _note(self, number: int, _frame: FrameType | None) -> None:
        self.signal = number
