"""Views of a run, drawn by whoever is installed for it: entry points of the group `deixis.views`."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path

from .options import CommandError
from .play import Beside

GROUP = "deixis.views"


def file_view(path: Path, site: Path | None, robot: str) -> Beside:
    """What draws a run of this robot into a file of this kind. Raises CommandError where nothing here can, or not there."""
    kind = path.suffix.removeprefix(".")
    kinds = {entry.name: entry for entry in entry_points(group=GROUP)}
    if not kinds:
        raise CommandError(f"--view {path}: the distribution deixis-view is not installed here")
    if kind not in kinds:
        raise CommandError(f"--view {path}: the file's name has to end in {' or '.join(f'.{name}' for name in sorted(kinds))}")
    drawn: Beside = kinds[kind].load()(path, site, robot)
    return drawn
