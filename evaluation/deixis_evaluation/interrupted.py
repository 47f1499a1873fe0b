"""A run that was stopped before its end."""

from __future__ import annotations

import signal


class Interrupted(Exception):
    """SIGINT or SIGTERM came while something was played; `signal` says which."""

    def __init__(self, number: int) -> None:
        super().__init__(f"stopped by {signal.Signals(number).name}")
        self.signal = number
