"""What Linux says of processes in /proc. Elsewhere, and of processes that have ended, it says nothing."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

PROC = Path("/proc")
TICKS_S = os.sysconf("SC_CLK_TCK")
COULD_NOT_RUN = ("R", "D")  # waits for a processor or has one; waits for a disk


@dataclass(frozen=True)
class Look:
    """At a process: processor seconds used, and whether one of its threads would run but for others (or does run)."""

    cpu_s: float
    wants_to_run: bool


def look_at(pid: int) -> Look | None:
    """How a process stands now; None where that cannot be known."""
    try:
        threads = [stat_fields(path.read_text("utf-8")) for path in (PROC / str(pid) / "task").glob("*/stat")]
        whole = stat_fields((PROC / str(pid) / "stat").read_text("utf-8"))
    except OSError:
        return None
    return Look((int(whole[11]) + int(whole[12])) / TICKS_S, any(fields[0] in COULD_NOT_RUN for fields in threads))


def stat_fields(text: str) -> list[str]:
    """The fields of /proc/PID/stat from the state on; the name before may hold anything."""
    return text.rpartition(")")[2].split()


def unable_s(before: Look, now: Look, between_s: float) -> float:
    """For how much of the time between two looks a process could not run though it would have.

    A process that was stopped, or whose threads wait for each other, could run and did not. Tasks that run in turn on a busy
    machine use less of the processor than the time that passes.
    """
    return max(0.0, between_s - (now.cpu_s - before.cpu_s)) if now.wants_to_run else 0.0


def locked_inodes() -> dict[int, set[tuple[int, int]]]:
    """What each process holds a lock on, as (device, inode), by process number; empty where that cannot be known."""
    try:
        return parse_locks((PROC / "locks").read_text("utf-8"))
    except OSError:
        return {}


def parse_locks(text: str) -> dict[int, set[tuple[int, int]]]:
    """The advisory locks of whole files (flock) in /proc/locks. The kernel writes a line like
    `7: FLOCK  ADVISORY  READ 14294 00:1b:98 0 EOF`: process number, then device in hexadecimal and inode.
    """
    found: dict[int, set[tuple[int, int]]] = {}
    for line in text.splitlines():
        fields = line.split()
        if len(fields) == 8 and fields[1] == "FLOCK" and fields[4].isdigit():
            major, minor, inode = fields[5].split(":")
            found.setdefault(int(fields[4]), set()).add((os.makedev(int(major, 16), int(minor, 16)), int(inode)))
    return found
