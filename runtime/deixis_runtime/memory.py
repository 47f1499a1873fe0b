"""Memory that a process does not need any more, given back to the system."""

from __future__ import annotations

import ctypes
import gc
import mmap
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

SMAPS = Path("/proc/self/smaps")
_AREA = re.compile(r"([0-9a-f]+)-([0-9a-f]+) (\S+) \S+ \S+ \S+ +(/.*)")


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


def let_go_of_libraries() -> None:
    """For a process that did imports for others and does no more: its pages of libraries, 11 MB.

    Those that are needed again come back from the system's cache as they are. In the stages it saves no more.
    """
    advise = getattr(ctypes.CDLL(None), "madvise", None)
    if advise is None:
        return
    with suppress(OSError):  # there is no /proc: all stays as it is
        for begin, end in unwritten(SMAPS.read_text(encoding="utf-8", errors="replace")):
            advise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), mmap.MADV_DONTNEED)


def unwritten(smaps: str) -> Iterator[tuple[int, int]]:
    """Areas of files, as (begin, end), that cannot be written and have not been: code and constants, in /proc/PID/smaps.

    A page of a file that was written before it was protected, as the loader's tables are, is ours alone: it would be lost.
    """
    area: tuple[int, int] | None = None
    for line in smaps.splitlines():
        if match := _AREA.match(line):
            begin, end, rights, _ = match.groups()
            area = (int(begin, 16), int(end, 16)) if rights in ("r-xp", "r--p") else None
        elif line[:1] in "0123456789abcdef":
            area = None  # not of a file
        elif area is not None and line.startswith("Anonymous:"):
            if line.split()[1] == "0":
                yield area
            area = None
