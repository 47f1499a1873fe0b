"""Shows live what each stage sees: a line about every half second, or a table where there is a terminal."""

from __future__ import annotations

from types import TracebackType
from typing import Protocol, Self

from deixis_runtime.host import SOURCE
from deixis_schemas import topics
from deixis_schemas.messages import Belief, CameraInfo, Frame, Message, Target
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from . import wording
from .summary import Summary

LINE_EVERY_S = 0.5
REFRESH_HZ = 8.0


class View(Protocol):
    """Takes every message of a run."""

    def hear(self, key: str, message: Message) -> None:
        """Show what is new in the message."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...


def view_for(console: Console, names: dict[str, str], stages: tuple[str, ...]) -> View:
    """A table for a terminal, else lines."""
    return TableView(console, names, stages) if console.is_terminal else LineView(console, names, stages)


class LineView:
    """One compact line about every 0.5 s of clip time, and one for each target and each news of the camera."""

    def __init__(self, console: Console, names: dict[str, str], stages: tuple[str, ...]) -> None:
        self._console = console
        self._summary = Summary(names)
        # The frame's last word: fusion's answer where it runs.
        self._beat: type[Message] = Belief if topics.BELIEF.stage in stages else Frame
        self._due_s = 0.0
        self._camera = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing to put back."""

    def hear(self, _key: str, message: Message) -> None:
        """Print what is due."""
        summary = self._summary
        summary.hear(message)
        if isinstance(message, CameraInfo) and summary.camera != self._camera:
            self._camera = summary.camera
            self._say(f"camera {summary.camera}")
        elif isinstance(message, Target):
            self._say(wording.target_line(message, summary.names))
        elif self._is_due(message):
            self._due_s = summary.clip_s + LINE_EVERY_S
            self._say(summary.line())

    def _is_due(self, message: Message) -> bool:
        behind_s = self._summary.clip_s - self._due_s
        if isinstance(message, self._beat):
            return behind_s >= 0 or behind_s < -2  # played anew, as with --loop
        return isinstance(message, Frame) and behind_s > LINE_EVERY_S  # fusion is there, but answers nothing

    def _say(self, text: str) -> None:
        self._console.out(text, highlight=False)
        self._console.file.flush()


class TableView:
    """A table that is redrawn, with the final targets as lines above it."""

    def __init__(self, console: Console, names: dict[str, str], stages: tuple[str, ...]) -> None:
        self._summary = Summary(names)
        self._stages = stages
        self._live = Live(console=console, get_renderable=self._table, refresh_per_second=REFRESH_HZ)

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /) -> None:
        self._live.__exit__(kind, error, trace)

    def hear(self, _key: str, message: Message) -> None:
        """Take in the message; the table is redrawn by itself."""
        self._summary.hear(message)
        if isinstance(message, Target) and message.final:
            self._live.console.print(Text(wording.target_line(message, self._summary.names), style="bold green"))

    def _table(self) -> Table:
        summary = self._summary
        table = Table(show_header=False, title=f"{summary.clip_s:.1f} s, frame {summary.seq}", title_justify="left")
        frames = f"{summary.camera}, {summary.rate_hz():.0f} frames/s, {summary.drops()} dropped"
        for stage in self._stages:
            table.add_row(stage, Text(frames if stage == SOURCE else summary.words.get(stage, "-")))
        if summary.target is not None:
            table.add_row("target", Text(wording.target_line(summary.target, summary.names)))
        for fault in summary.faults():
            table.add_row("fault", Text(fault, style="red"))
        return table
