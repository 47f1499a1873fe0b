"""What a process's memory consists of, and which of its threads take how much processor, as Linux says in /proc."""

from __future__ import annotations

import os
import re
from collections import Counter
from pathlib import Path

from process_use import SHARED_MEMORY, ProcessEnded

OBJECTS, LIBRARIES, SHARED, STACKS = "objects", "libraries", "shared_memory", "stacks"
PARTS = (OBJECTS, LIBRARIES, SHARED, STACKS)
"""Objects: what Python, C and Rust allocate. Libraries: code and what is mapped with it. Shared memory: of /dev/shm."""
LOOP, ZENOH, OTHER = "loop", "zenoh", "other"
THREADS = (LOOP, ZENOH, OTHER)
"""Loop: the main thread, in which a stage works. Zenoh: its threads. Other: of OpenCV and Python, as a camera's reader."""
ZENOH_THREAD = re.compile(r"(app|acc|net|rx|tx)-\d+|Watchdog ")
_AREA = re.compile(r"[0-9a-f]+-[0-9a-f]+ ")


def parts_of(pid: int) -> dict[str, float]:
    """Its share of pages by PARTS, MB: a page counts to each process that has it with an equal share. Raises ProcessEnded."""
    try:
        text = Path(f"/proc/{pid}/smaps").read_text(encoding="utf-8")
    except (FileNotFoundError, ProcessLookupError):
        raise ProcessEnded(f"process {pid} has ended") from None
    return parse_parts(text)


def parse_parts(text: str) -> dict[str, float]:
    """The same of the text of /proc/PID/smaps."""
    kb, part = Counter[str](dict.fromkeys(PARTS, 0)), OBJECTS
    for line in text.splitlines():
        if _AREA.match(line):
            fields = line.split(None, 5)
            part = _part_of(fields[5] if len(fields) == 6 else "")
        elif line.startswith("Pss:"):
            kb[part] += int(line.split()[1])
    return {part: kb[part] / 1024 for part in PARTS}


def thread_seconds(pid: int) -> dict[str, float]:
    """Processor seconds so far by THREADS, of threads that live. Raises ProcessEnded."""
    spent = dict.fromkeys(THREADS, 0.0)
    try:
        for thread in os.listdir(f"/proc/{pid}/task"):
            folder = Path(f"/proc/{pid}/task/{thread}")
            name = (folder / "comm").read_text(encoding="utf-8").strip()
            kind = LOOP if thread == str(pid) else ZENOH if ZENOH_THREAD.match(name) else OTHER
            spent[kind] += int((folder / "schedstat").read_text(encoding="ascii").split()[0]) / 1e9
    except (FileNotFoundError, ProcessLookupError):
        raise ProcessEnded(f"process {pid} or one of its threads has ended") from None
    return spent


def _part_of(name: str) -> str:
    if name.startswith(SHARED_MEMORY):
        return SHARED
    if name.startswith("[stack"):
        return STACKS
    return LIBRARIES if name.startswith("/") else OBJECTS
