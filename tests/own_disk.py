"""A small disk of a test's own, in a mount namespace that nobody else sees: it can be filled, emptied and made read-only."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

MEMORY = 'mount -t tmpfs -o size="$1" tmpfs "$2"'
# A file system that finds an error in itself turns read-only under all who have files open there, as old memory cards do.
FAILING = (
    'truncate -s "$1" "$2.image" && mkfs.ext4 -q -O ^has_journal "$2.image" && mount -o loop,errors=remount-ro "$2.image" "$2"'
)


class Disk:
    """A disk at `path`, as seen by processes that are started with `within` before their command."""

    def __init__(self, path: Path, holder: int) -> None:
        self.path = path
        self.within: Sequence[str] = ("nsenter", "-t", str(holder), "-m")
        self._seen_here = Path(f"/proc/{holder}/root") / path.relative_to("/")

    def run(self, *argv: object) -> str:
        """What a command says that is run where the disk is seen. Raises subprocess.CalledProcessError."""
        return subprocess.run([*self.within, *map(str, argv)], check=True, capture_output=True, text=True).stdout

    def files(self) -> list[str]:
        """Names of what lies on it."""
        return sorted(file.name for file in self._seen_here.iterdir())

    def fill(self) -> None:
        """Leave no room on it."""
        with (self._seen_here / "fill").open("wb", buffering=0) as file:
            for size in (4096, 1):
                while _fits(file.fileno(), size):
                    pass

    def empty(self) -> None:
        """Take away what filled it."""
        (self._seen_here / "fill").unlink()

    def make_read_only(self) -> None:
        """Let nobody write to it; possible only while nobody has a file open there for writing."""
        self.run("mount", "-o", "remount,ro", self.path)

    def find_an_error(self) -> None:
        """Make a failing disk find an error in itself: it is read-only from now on."""
        device = self.run("findmnt", "-no", "SOURCE", self.path).strip()
        (Path("/sys/fs/ext4") / Path(device).name / "trigger_fs_error").write_text("an error made by a test")


def _fits(file: int, size: int) -> bool:
    try:
        return os.write(file, bytes(size)) > 0
    except OSError:
        return False


@contextmanager
def own_disk(folder: Path, size: str, how: str = MEMORY) -> Iterator[Disk]:
    """A disk of that size (`512k`), mounted in a namespace of its own on a new folder in `folder`."""
    (path := folder / "disk").mkdir()
    script = f"{how} && echo up && exec sleep infinity"
    argv = ["unshare", "-m", "sh", "-c", script, "sh", size, str(path)]
    with subprocess.Popen(argv, stdout=subprocess.PIPE, text=True) as holder:
        try:
            assert holder.stdout is not None
            assert holder.stdout.readline() == "up\n", f"cannot mount a disk on {path}"
            yield Disk(path, holder.pid)
        finally:
            holder.kill()


def missing_for_own_disk() -> str:
    """Why there can be no disk of a test's own here; empty if there can."""
    if os.geteuid() != 0:
        return "a disk of its own needs root"
    if shutil.which("nsenter") is None or shutil.which("unshare") is None:
        return "a disk of its own needs unshare and nsenter"
    tried = subprocess.run(
        ["unshare", "-m", "mount", "-t", "tmpfs", "tmpfs", "/mnt"], check=False, capture_output=True, text=True
    )
    return f"a disk of its own needs mount namespaces: {tried.stderr.strip()}" if tried.returncode else ""


def missing_for_failing_disk(folder: Path) -> str:
    """Why no disk can fail here; empty if one can. Tries it in `folder`."""
    if absent := [tool for tool in ("mkfs.ext4", "findmnt", "truncate") if shutil.which(tool) is None]:
        return f"a failing disk needs {', '.join(absent)}"
    try:
        with own_disk(folder, "2M", FAILING) as disk:
            disk.find_an_error()
    except (AssertionError, OSError, subprocess.CalledProcessError) as error:
        return f"a failing disk needs loop devices and ext4: {error}"
    finally:
        shutil.rmtree(folder / "disk", ignore_errors=True)
    return ""
