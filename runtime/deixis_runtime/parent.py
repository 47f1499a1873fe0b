"""Whether the process that started us is still there: who was started by a supervisor ends with it, killed or not."""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Mapping

PR_SET_PDEATHSIG = 1
SUPERVISED_BY = "DEIXIS_SUPERVISED_BY"
"""Environment variable by which a supervisor tells its children its process number."""


class Parent:
    """The parent as the environment names it. Without a name it is the one that we have now, which may be another already.

    For the main thread of a process that a supervisor has started; it ends by `gone` and by SIGTERM, no more by SIGHUP.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        # When a supervisor is killed, the kernel may send SIGHUP to those of its children that are stopped, and would end them
        # before they have cleaned up.
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        _be_continued_at_its_end()
        named = environment.get(SUPERVISED_BY, "")
        self._pid = int(named) if named.isdigit() else os.getppid()

    def gone(self) -> bool:
        """Whether it has ended; the kernel gives its children another parent at once."""
        return os.getppid() != self._pid


def _be_continued_at_its_end() -> None:
    """Have the kernel send us SIGCONT when the parent ends: one that is stopped could not see that it is gone.

    By itself the kernel continues stopped children only where nobody of their session is left to do so, which is not so below
    a program that adopts orphans (PR_SET_CHILD_SUBREAPER).
    """
    prctl = getattr(ctypes.CDLL(None, use_errno=True), "prctl", None)
    if prctl is not None:  # elsewhere than on Linux there is none
        prctl(PR_SET_PDEATHSIG, int(signal.SIGCONT), 0, 0, 0)
