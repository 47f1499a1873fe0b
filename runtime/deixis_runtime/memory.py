"""Memory that a process does not need any more, given back to the system."""

from __future__ import annotations

import ctypes
import gc


def settle() -> None:
    """When a process is ready: give back what only its start needed, and spare the collector what lasts for good.

    A full collection looks at all objects there are, and writes to them: with what was imported it takes 20 ms and, in a
    process that was forked, a copy of each page they lie on.
    """
    gc.collect()
    gc.freeze()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc's
    if trim is not None:
        trim(0)
