"""How far clips are played, on standard error."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from .clips import Clip

OnFrame = Callable[[], None]
Complain = Callable[[str], None]


def played(clips: Sequence[Clip]) -> Iterator[tuple[Clip, OnFrame, Complain]]:
    """Each clip to be played, with what to call for each of its frames, and to say what is wrong with it."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("frames"), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("", total=sum(len(clip.truth.frames) for clip in clips))

        def complain(text: str) -> None:
            progress.console.print(text, style="red", markup=False)

        done = 0
        for count, clip in enumerate(clips, 1):
            progress.update(task, description=f"{clip.name} ({count} of {len(clips)})")
            yield clip, lambda: progress.advance(task), complain
            # Frames that were not answered are done with, too.
            done += len(clip.truth.frames)
            progress.update(task, completed=done)
