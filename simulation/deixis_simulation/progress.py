"""Progress of a rendering on the terminal, with an estimate of what is left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from .jobs import Progress
from .scene import Scene

ESTIMATE_OVER_S = 600.0
"""Clips differ in size and people; the estimate looks at some of them together."""


@contextmanager
def shown_progress(scenes: Sequence[Scene]) -> Iterator[Progress]:
    """A bar on standard error, or a line a clip where that is no terminal. It counts pixels: a large clip is more work."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Bar(*columns, console=console, speed_estimate_period=ESTIMATE_OVER_S, disable=not console.is_terminal) as bar:
        shown = _Shown(bar, console, len(scenes), sum(_work(scene) for scene in scenes))
        yield Progress(frame=shown.frame, ends=shown.ends, skips=shown.skips, fails=shown.fails)


class _Shown:
    def __init__(self, bar: Bar, console: Console, clips: int, work: int) -> None:
        self._bar, self._console, self._clips, self._work = bar, console, clips, work
        self._over = 0
        self._task = bar.add_task(self._said(), total=work)

    def frame(self, scene: Scene) -> None:
        self._bar.advance(self._task, _pixels(scene))

    def ends(self, scene: Scene) -> None:
        self._count(f"{scene.name} is rendered")

    def skips(self, scene: Scene) -> None:
        # Taken from what is to do, not added to what is done: the estimate would take it for speed.
        self._work -= _work(scene)
        self._bar.update(self._task, total=self._work)
        self._count(f"{scene.name} was there already")

    def fails(self, scene: Scene, why: str) -> None:
        self._bar.console.print(f"{scene.name}: {why}", style="red", markup=False)
        self._count(f"{scene.name} failed")

    def _count(self, what: str) -> None:
        self._over += 1
        self._bar.update(self._task, description=self._said())
        if not self._console.is_terminal:
            self._console.print(f"{self._said()}: {what}", markup=False, highlight=False)

    def _said(self) -> str:
        return f"{self._over} of {self._clips} clips"


def _pixels(scene: Scene) -> int:
    return scene.camera.width * scene.camera.height


def _work(scene: Scene) -> int:
    return _pixels(scene) * scene.frames
