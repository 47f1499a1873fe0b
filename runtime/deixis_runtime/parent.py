"""Whether the process that started us is still there: who was started by a supervisor ends with it, killed or not."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping

SUPERVISED_BY = "DEIXIS_SUPERVISED_BY"
"""Environment variable by which a supervisor tells its children its process number."""


class Parent:
    """The parent as the environment names it. Without a name it is the one that we have now, which may be another already.

    For the main thread of a process that a supervisor has started; it ends by `gone` and by SIGTERM, no more by SIGHUP.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        # When a supervisor is killed, the kernel sends SIGHUP and SIGCONT to those of its children that are stopped, and would
        # end them before they have cleaned up.
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        named = environment.get(SUPERVISED_BY, "")
        self._pid = int(named) if named.isdigit() else os.getppid()

    def gone(self) -> bool:
        """Whether it has ended; the kernel gives its children another parent at once."""
        return os.getppid() != self._pid
