"""The temporary folder of a viewer, and those that killed ones have left."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path

PREFIX = "deixis-view-"
YOUNG_S = 10.0
"""A folder is locked just after it was made: one so young is let alone."""


class Workplace:
    """A temporary folder, with a lock on it for as long as it is used. Use as a context manager, which gives its path.

    Who is killed cannot remove it; the lock ends with its process. So the next who makes one removes those without a lock.
    """

    def __enter__(self) -> Path:
        """Raises OSError where no folder can be made."""
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        self._lock = os.open(self.path, os.O_RDONLY)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        remove_left(self.path.parent)
        return self.path

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._lock)


def remove_left(folder: Path) -> None:
    """Remove the workplaces in a folder whose processes have ended."""
    for path in folder.glob(f"{PREFIX}*"):
        with suppress(OSError):  # it has just gone, or is another user's
            if time.time() - path.stat().st_mtime > YOUNG_S:
                _remove_unlocked(path)


def _remove_unlocked(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(path, ignore_errors=True)
    except BlockingIOError:
        pass  # somebody looks at it
    finally:
        os.close(descriptor)
