"""Ctrl-C and SIGTERM as a flag that loops look at, so that nothing is torn apart halfway."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any, Self

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """While entered, SIGINT and SIGTERM only set `signal`. Elsewhere than in the main thread it changes nothing."""

    def __init__(self) -> None:
        self.signal: int | None = None
        self._event = threading.Event()
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
        return self._event.wait(timeout_s)

    def exit_status(self) -> int:
        """What a shell expects of a process that was interrupted: 128 and the signal's number; 0 if it was not."""
        return 128 + self.signal if self.signal is not None else 0

    def _note(self, number: int, _frame: FrameType | None) -> None:
        self.signal = number
        self._event.set()
