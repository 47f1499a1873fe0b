"""What processes hold: memory, descriptors, threads, shared memory and temporary files, as Linux says in /proc."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

SHARED_MEMORY = "/dev/shm/"
MB = 1 << 20


class ProcessEnded(RuntimeError):
    """A process is not there any more; the text names it."""


@dataclass(frozen=True)
class Use:
    """What a process holds. `rss_mb` counts pages that are shared in full, `pss_mb` its share of them."""

    rss_mb: float
    pss_mb: float
    descriptors: int
    threads: int


def use_of(pid: int) -> Use:
    """What the process holds now. Raises ProcessEnded."""
    folder = Path(f"/proc/{pid}")
    try:
        memory_kb = parse_rollup((folder / "smaps_rollup").read_text(encoding="utf-8"))
        descriptors, threads = (len(os.listdir(folder / name)) for name in ("fd", "task"))
    except (FileNotFoundError, ProcessLookupError):
        raise ProcessEnded(f"process {pid} has ended") from None
    return Use(memory_kb["Rss"] / 1024, memory_kb["Pss"] / 1024, descriptors, threads)


def cpu_s_of(pid: int) -> float:
    """User and system seconds that the process has used. Raises ProcessEnded."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        raise ProcessEnded(f"process {pid} has ended") from None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def parse_rollup(text: str) -> dict[str, int]:
    """The sizes of /proc/PID/smaps_rollup by name, kB; its first line is an address."""
    rows = (line.split() for line in text.splitlines()[1:])
    return {row[0].rstrip(":"): int(row[1]) for row in rows if len(row) == 3}


def shared_files_of(pid: int) -> set[str]:
    """Files of /dev/shm that the process has mapped, also those without a name by now (` (deleted)`). Raises ProcessEnded."""
    try:
        lines = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8").splitlines()
    except (FileNotFoundError, ProcessLookupError):
        raise ProcessEnded(f"process {pid} has ended") from None
    return {fields[5] for line in lines if len(fields := line.split(None, 5)) == 6 and fields[5].startswith(SHARED_MEMORY)}


def size_mb(files: Iterable[Path]) -> float:
    """What the files take on their disk; one that is gone takes nothing."""
    return sum(_size(file) for file in files) / MB


def files_below(folder: Path) -> list[Path]:
    """All that lies in a folder, at any depth."""
    return [Path(where) / name for where, folders, names in os.walk(folder) for name in (*folders, *names)]


def _size(file: Path) -> int:
    try:
        return file.lstat().st_blocks * 512
    except FileNotFoundError:
        return 0
