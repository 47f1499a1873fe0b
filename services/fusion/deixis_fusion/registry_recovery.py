"""A corrupt registry is set aside, never overwritten, and its last good copy is used."""

from __future__ import annotations

import os
import shutil
from datetime import UTC, datetime
from pathlib import Path

from .registry import CorruptError, Registry, RegistryError, copy_of

SIDE_FILES = ("-wal", "-shm")


def open_registry_file(path: Path) -> tuple[Registry, str]:
    """The registry of a file and, where that was corrupt, in words what was done about it.

    Raises RegistryError, also where it is corrupt and there is no good copy: to begin anew is for people to decide.
    """
    good = copy_of(path)
    try:
        # Of a disk that was full or a host that lost its power: SQLite would take it for a new one.
        if good.is_file() and path.is_file() and path.stat().st_size == 0:
            raise CorruptError(f"registry {path}: is corrupt: it is empty")
        return Registry(path), ""
    except CorruptError as error:
        if not good.is_file():
            raise RegistryError(f"{error}; no good copy is beside it ({good.name}): move it away to begin anew") from None
        try:
            aside = _exchange(path, good)
        except (OSError, RegistryError) as failed:
            raise RegistryError(f"{error}; its last good copy {good.name} cannot take its place: {failed}") from None
        registry = Registry(path)
        made = datetime.fromtimestamp(good.stat().st_mtime, UTC)
        count = len(registry.pois())
        used = f"its last good copy is used, {count} POIs of {made:%Y-%m-%d %H:%M:%S} UTC; later edits are lost"
        return registry, f"{error}; it is set aside as {aside.name}, and {used}"


def _exchange(path: Path, good: Path) -> Path:
    """Keep the corrupt file under another name and put the copy in its place, so that there is one whenever this is cut off.

    Raises RegistryError where the copy is damaged as well; then nothing is changed.
    """
    fresh = path.with_name(path.name + ".fresh")
    _copy_sound(good, fresh)
    aside = _free_name(path)
    shutil.copy2(path, aside)
    for ending in SIDE_FILES:
        # What it had not yet taken over into itself; beside the copy it would spoil that.
        beside = path.with_name(path.name + ending)
        if beside.exists():
            beside.replace(aside.with_name(aside.name + ending))
    fresh.replace(path)
    return aside


def _copy_sound(good: Path, fresh: Path) -> None:
    """Copy it to disk where it holds a registry. Raises RegistryError."""
    if good.stat().st_size == 0:
        raise CorruptError("it is empty")
    shutil.copyfile(good, fresh)
    try:
        Registry(fresh).close()
    except RegistryError:
        fresh.unlink()
        raise
    with fresh.open("rb") as written:
        os.fsync(written.fileno())


def _free_name(path: Path) -> Path:
    number = 1
    while (aside := path.with_name(f"{path.name}.corrupt-{number}")).exists():
        number += 1
    return aside
