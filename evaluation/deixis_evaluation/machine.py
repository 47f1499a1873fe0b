"""Names the machine that figures were measured on."""

from __future__ import annotations

import os
import platform
from pathlib import Path

Machine = dict[str, str | int | float]


def describe_machine() -> Machine:
    """Processor, cores that this process may use, memory, Python and kernel."""
    return {
        "cpu": _cpu_model(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1,
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1),
        "python": platform.python_version(),
        "kernel": f"{platform.system()} {platform.release()}",
    }


def say_machine(machine: Machine) -> str:
    """The machine in one line."""
    return "{cpu}, {cores} cores, {memory_gb} GB, Python {python}, {kernel}".format(**machine)


def _cpu_model(path: Path = Path("/proc/cpuinfo")) -> str:
    if path.exists():
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()
