"""A place with a /dev/shm and a temporary folder of its own: for tests of what processes leave there.

Needs root and util-linux.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from namespace_holder import NamespaceHolder


def missing_for_private_shm() -> str:
    """Why there can be none here; empty if there can."""
    if os.geteuid() != 0:
        return "a private /dev/shm needs root"
    absent = [tool for tool in ("unshare", "nsenter") if shutil.which(tool) is None]
    if absent:
        return f"a private /dev/shm needs {', '.join(absent)}"
    tried = subprocess.run(["unshare", "-m", "true"], check=False, capture_output=True, text=True)
    return f"a private /dev/shm needs a mount namespace: {tried.stderr.strip()}" if tried.returncode else ""


class PrivateShm(NamespaceHolder):
    """Use as a context manager. A command of `command` is the process that it names, and not a child of one."""

    def __init__(self, folder: Path) -> None:
        self.temporary = folder / "tmp"
        self.temporary.mkdir()
        script = "mount -t tmpfs tmpfs /dev/shm && echo up && exec sleep infinity"
        super().__init__(["unshare", "-m", "sh", "-c", script], "a private /dev/shm")

    def command(self, argv: Sequence[object]) -> list[str]:
        """`argv` as it has to be started to run there."""
        inside = ["nsenter", "-t", str(self.pid), "-m"]
        return [*inside, "env", f"TMPDIR={self.temporary}", *map(str, argv)]

    def shared_memory(self) -> set[str]:
        """Names of the files in its /dev/shm."""
        return set(os.listdir(f"/proc/{self.pid}/root/dev/shm"))

    def temporary_files(self) -> set[str]:
        """Names of the files and folders in its temporary folder."""
        return set(os.listdir(self.temporary))
