"""Shared memory that killed processes leave: Zenoh's files in /dev/shm, of which each session makes one of 16 MB.

All who use a file, its maker and its readers, hold a shared flock on it. Readers of Zenoh forget, when their process ends, what
a killed maker left; so who ends in good order removes what it is the last to hold. The rest is the supervisor's: it knows from
before what a process held that was killed, and removes of that what nobody holds any more, in whichever container.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path

FOLDER = Path("/dev/shm")
PATTERN = "*.zenoh"

Inode = tuple[int, int]


class Leftovers:
    """Remembers what our processes hold, and says what of it may be left of those that ended. No I/O."""

    def __init__(self) -> None:
        self._held: dict[int, set[Inode]] = {}
        self._left: set[Inode] = set()

    def note(self, pids: Collection[int], locked: Mapping[int, set[Inode]]) -> None:
        """`pids` of ours run now; `locked` says who holds what."""
        ended = [pid for pid in self._held if pid not in pids]
        for pid in ended:
            self._left |= self._held.pop(pid)
        for pid in pids:
            self._held.setdefault(pid, set()).update(locked.get(pid, ()))

    def left(self) -> set[Inode]:
        """What those held who have ended; others may hold it still."""
        return set(self._left)

    def forget(self, inodes: Collection[Inode]) -> None:
        """These are gone."""
        self._left -= set(inodes)


def remove_unused(inodes: Collection[Inode], folder: Path = FOLDER) -> tuple[set[Inode], int]:
    """Remove those of Zenoh's files that nobody holds. Returns which of `inodes` are gone, and how many we removed."""
    gone, removed = set(inodes), 0
    for path in folder.glob(PATTERN) if inodes else ():
        with suppress(OSError):  # it has just gone, or is another user's
            stat = path.stat()
            inode = (stat.st_dev, stat.st_ino)
            if inode not in gone:
                continue
            gone.discard(inode)
            if _remove_unlocked(path):
                gone.add(inode)
                removed += 1
    return gone, removed


def let_go(descriptors: Path = Path("/proc/self/fd"), folder: Path = FOLDER) -> None:
    """Let go of all that this process holds, and remove what nobody else holds. Only for a process that ends now."""
    for link in descriptors.iterdir():
        with suppress(OSError):  # the descriptor of the listing itself is closed by now
            path = Path(os.readlink(link))
            if path.parent == folder and path.match(PATTERN):
                _let_go(int(link.name), path)


def _let_go(descriptor: int, path: Path) -> None:
    fcntl.flock(descriptor, fcntl.LOCK_UN)
    with suppress(BlockingIOError):  # others use it, and the last of them removes it
        # After our lock is gone and not before: of two that end at once one finds itself alone.
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink()


def _remove_unlocked(path: Path) -> bool:
    """Remove a file unless somebody holds a lock on it."""
    descriptor = os.open(path, os.O_RDWR)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink()
    except BlockingIOError:
        return False
    finally:
        os.close(descriptor)
    return True
