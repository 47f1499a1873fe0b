"""Gathers sightings of a board from pictures: with a progress bar, or live with a hint at what is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from deixis_runtime.interrupts import Interrupts
from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from .album import Album
from .coverage import Coverage, cover, hint
from .picture_sources import Named, PictureSource
from .sightings import Image, Sighting

Find = Callable[[str, Image], Sighting | None]
Show = Callable[[Album, str], None]
EVERY = 5
"""Of a video each so-many-th picture is looked at: a board moves little in between."""
LIVE_WANTED = 25


def gather(source: PictureSource, find: Find, album: Album, interrupts: Interrupts, console: Console) -> None:
    """Look for the board in all pictures; live until nothing is missing. Ends early on an interrupt."""
    shown = _live(console) if source.live else _progress(source, console)
    step = 1 if source.live or not source.moving else EVERY
    with shown as show:
        for picture in source.pictures:
            if interrupts.requested() or album.full:
                return
            if picture.number % step == 0 or picture.image is None:
                _look(picture, find, album)
            show(album, picture.name)
            if source.live and len(album.kept) >= LIVE_WANTED and not hint(cover(album.board, album.kept)):
                return


def _look(picture: Named, find: Find, album: Album) -> None:
    if picture.image is None:
        album.refuse(picture.name, picture.why)
    else:
        album.add(picture.name, find(picture.name, picture.image))


@contextmanager
def _progress(source: PictureSource, console: Console) -> Iterator[Show]:
    """A bar of the pictures that were looked at, and how long the rest will take."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("pictures"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("looking for the board", total=source.total)

        def show(album: Album, _name: str) -> None:
            progress.update(task, advance=1, description=f"board seen in {len(album.kept)}")

        yield show


@contextmanager
def _live(console: Console) -> Iterator[Show]:
    """The cells that were covered and what to do next; as lines where this is no terminal."""
    said = ""

    def show_line(album: Album, _name: str) -> None:
        nonlocal said
        todo = hint(cover(album.board, album.kept))
        text = f"{len(album.kept)} pictures. {todo or f'Go on until there are {LIVE_WANTED}.'}"
        if text != said:
            said = text
            console.print(text, markup=False, highlight=False)

    if not console.is_terminal:
        yield show_line
        return
    with Live(console=console, refresh_per_second=8) as live:

        def show(album: Album, name: str) -> None:
            live.update(screen_of(album, cover(album.board, album.kept), album.refused.get(name, "kept")))

        yield show


def screen_of(album: Album, coverage: Coverage, last: str) -> Group:
    """What stands on the terminal while pictures come."""
    cells = [Text(" ".join("██" if count else "··" for count in row), style="cyan") for row in coverage.counts]
    return Group(
        Text(f"{len(album.kept)} of {LIVE_WANTED} pictures, the last: {last}"),
        *cells,
        Text(f"{100 * coverage.share:.0f} % of the picture, tilts up to {coverage.tilt_deg:.0f} degrees apart", style="dim"),
        Text(hint(coverage) or "Nothing is missing; a few more pictures make it surer.", style="bold yellow"),
        Text("Ctrl-C ends it and measures with what there is.", style="dim"),
    )
