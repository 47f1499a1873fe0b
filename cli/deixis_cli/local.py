"""What can be said of this machine alone, with or without a router: shared memory, versions, certificates, cameras."""

from __future__ import annotations

import os
import platform
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

from deixis_runtime.certificate_check import examine
from deixis_runtime.certificates import certificates_of
from deixis_runtime.finding import LOCAL_CHECKS, Finding
from deixis_runtime.host import installed_stages
from deixis_runtime.versions import versions_of

SHARED_MEMORY = Path("/dev/shm")
SESSION_BYTES = 16 << 20
"""Shared memory that one Zenoh session takes."""
COST = "stages work without it, but every frame is then copied through the router's socket for each stage that reads it"


@dataclass(frozen=True)
class Room:
    """How a folder of shared memory stands. `free` is in bytes; `refused` says why nothing can be written there, if so."""

    free: int
    refused: str = ""


def examine_machine(source: str | None) -> Iterator[Finding]:
    """All that is to be said of this machine. `source`: also open this camera, file or stream."""
    stages = installed_stages()
    yield from versions(versions_of(*(f"deixis-{name}" for name in (*stages, "cli"))))
    yield from shared_memory(SHARED_MEMORY, room(SHARED_MEMORY), len(stages) + 1)
    certificates = certificates_of()
    if certificates is not None:
        yield examine(certificates, time.time())
    for point in sorted(entry_points(group=LOCAL_CHECKS), key=lambda point: point.name):
        yield from point.load()(source)


def versions(installed: Mapping[str, str]) -> Iterator[Finding]:
    """Versions of the distributions here; those of Deixis have to be of one release."""
    ours = {name: version for name, version in installed.items() if name.startswith("deixis-")}
    others = ", ".join(f"{name} {version}" for name, version in installed.items() if name not in ours)
    if len(set(ours.values())) > 1:
        listed = ", ".join(f"{name} {version}" for name, version in sorted(ours.items()))
        yield Finding(
            "wrong", f"the distributions of Deixis here are of different versions: {listed}", "install all of one release"
        )
    else:
        version = next(iter(ours.values()), "of no known version")
        yield Finding("ok", f"Deixis {version} with {others}, Python {platform.python_version()}")


def room(folder: Path) -> Room | None:
    """What there is in a folder of shared memory; None where it is not there. Writes a file and removes it."""
    try:
        status = os.statvfs(folder)
    except OSError:
        return None
    try:
        with tempfile.TemporaryFile(dir=folder):
            return Room(status.f_bavail * status.f_frsize)
    except OSError as error:
        return Room(status.f_bavail * status.f_frsize, error.strerror or str(error))


def shared_memory(folder: Path, found: Room | None, sessions: int) -> Iterator[Finding]:
    """Whether the stages and the router of this machine, so many sessions, can share frames in memory."""
    if found is None:
        yield Finding("wrong", f"there is no shared memory: {folder} is missing", f"mount a tmpfs there; {COST}")
        return
    if found.refused:
        yield Finding("wrong", f"there is no shared memory: {folder} cannot be written ({found.refused})", f"mend that; {COST}")
        return
    free_mb, needed_mb = found.free / (1 << 20), sessions * SESSION_BYTES / (1 << 20)
    if found.free < sessions * SESSION_BYTES:
        what = f"shared memory is too small: {free_mb:.0f} MB are free in {folder}, {sessions} sessions take {needed_mb:.0f} MB"
        advice = f"remove what was left behind there, or give it more (Docker: shm_size: 256m); {COST}"
        # Those that find room use it.
        yield Finding("wrong" if found.free < SESSION_BYTES else "note", what, advice)
    else:
        yield Finding("ok", f"{free_mb:.0f} MB of shared memory are free in {folder}")
