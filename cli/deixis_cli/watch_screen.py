"""`deixis watch` on a terminal: a line for each pointing that ended, and below it what is believed and how the stages fare.

Redrawn four times a second in place, so that it is of use over ssh.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from deixis_schemas import topics
from deixis_schemas.messages import Belief, Health, Message, OfFrame, PersonBelief, PoiBelief, Target
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from . import wording
from .summary import Summary

REFRESH_HZ = 4.0
BAR_CELLS = 24
MOST_BARS = 5
MOST_PERSONS = 3
STALE_S = 3.0
"""What is older is not shown as if it were so now: the age of a health record after which a stage counts as silent."""
STYLES = {"ok": "green", "degraded": "yellow", "failed": "red", "silent": "red", "-": "dim"}


class WatchScreen:
    """Takes what is heard and draws it. Use as a context manager, which leaves the last picture on the terminal.

    `clock` gives seconds, monotonic.
    """

    def __init__(self, console: Console, robot: str, summary: Summary, clock: Callable[[], float] = time.monotonic) -> None:
        self._robot = robot
        self._summary = summary
        self._clock = clock
        self._belief: Belief | None = None
        self._spoke_s: dict[str, float] = {}
        self._health: dict[str, tuple[Health, float]] = {}
        self._live = Live(console=console, get_renderable=self.picture, refresh_per_second=REFRESH_HZ)

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /) -> None:
        self._live.__exit__(kind, error, trace)

    def hear(self, message: Message) -> None:
        """Take in one message; a final target becomes a text that stays."""
        self._summary.hear(message)
        if isinstance(message, OfFrame):
            self._spoke_s[message.stage] = self._clock()
        if isinstance(message, Belief):
            self._belief = message
        elif isinstance(message, Health):
            self._health[message.stage] = (message, self._clock())
        elif isinstance(message, Target) and message.final:
            # Whole, over several lines of a narrow terminal: it is what is left to scroll back to.
            self._live.console.print(episode_line(message, self._summary.names))

    def picture(self) -> RenderableType:
        """All that is redrawn."""
        return Group(self._head(), *self._persons(), self._stages())

    def _head(self) -> Text:
        summary = self._summary
        frame = f"frame {summary.seq}, {summary.rate_hz():.0f}/s" if summary.seq >= 0 else "no frame yet"
        return Text(f"{self._robot}: {frame}", style="bold")

    def _persons(self) -> list[RenderableType]:
        if self._belief is None or not self._speaks(topics.BELIEF.stage):
            return [Text("no beliefs come", style="red" if self._belief else "dim")]
        shown = self._belief.persons[:MOST_PERSONS]
        more = len(self._belief.persons) - len(shown)
        drawn: list[RenderableType] = [belief_bars(person, self._summary.names) for person in shown]
        return [*drawn, *([Text(f"and {more} more", style="dim")] if more else [])] or [Text("nobody in sight", style="dim")]

    def _stages(self) -> Table:
        table = Table(box=None, pad_edge=False, header_style="dim")
        for heading in ("stage", "state", "Hz", "ms a step", "sees"):
            table.add_column(heading, justify="right" if heading in ("Hz", "ms a step") else "left", overflow="ellipsis")
        for stage in topics.STAGES:
            table.add_row(*self._row(stage))
        return table

    def _row(self, stage: str) -> tuple[Text, ...]:
        words = self._summary.words.get(stage, "") if self._speaks(stage) else ""
        if stage not in self._health:
            return Text(stage), Text("-", style="dim"), Text(), Text(), Text(words, no_wrap=True)
        health, heard_s = self._health[stage]
        silent_s = self._clock() - heard_s
        state = health.state if silent_s <= STALE_S else "silent"
        why = f"for {silent_s:.0f} s" if state == "silent" else health.reason
        rate_hz = max((output.rate_hz for output in health.outputs), default=0.0)
        return (
            Text(stage),
            Text(state, style=STYLES[state]),
            Text(f"{rate_hz:.0f}"),
            Text(f"{health.step_ms_p50:.0f}"),
            Text(why or words, style="" if state == "ok" else STYLES[state], no_wrap=True),
        )

    def _speaks(self, stage: str) -> bool:
        """Whether it spoke of a frame lately."""
        return stage in self._spoke_s and self._clock() - self._spoke_s[stage] <= STALE_S


def episode_line(target: Target, names: wording.Names) -> Text:
    """One pointing that ended: when, who, for how long, and at what."""
    began = time.strftime("%H:%M:%S", time.localtime(target.started_ns / 1e9))
    lasted_s = max(0, target.ended_ns - target.started_ns) / 1e9
    best = next((poi for poi in target.pois if target.poi_ids and poi.poi_id == target.poi_ids[0]), None)
    sure = f", {wording.chance(best):.2f}" if best else ""
    text = f"{began}  person {target.person_id}, {lasted_s:.1f} s: {wording.answer(target, names)}{sure}"
    line = Text(text, style="bold green" if target.poi_ids else "yellow")
    return line.append(f"  {target.reason}", style="dim not bold")


def belief_bars(person: PersonBelief, names: wording.Names) -> RenderableType:
    """A bar for each of the likeliest POIs, and one for what is not known."""
    pointing = "points" if person.episode_id else "does not point"
    where = f", {person.distance_m:.1f} m away" if person.distance_m is not None else ""
    clash = f", head and hand disagree ({person.contour_conflict:.2f})" if person.contour_conflict > 0.5 else ""
    title = f"person {person.person_id} {pointing}{where}{clash}"
    table = Table(box=None, show_header=False, pad_edge=False)
    best = sorted(person.pois, key=wording.chance, reverse=True)[:MOST_BARS]
    for poi in best:
        table.add_row(*_bar(wording.titled(poi.poi_id, names), wording.chance(poi), _style(poi, best[0], person)))
    table.add_row(*_bar("not known (mass)", person.unknown, "bright_black"))
    return Group(Text(title), table)


def _bar(label: str, share: float, style: str) -> tuple[RenderableType, ...]:
    share = min(1.0, max(0.0, share))
    bar = ProgressBar(total=1.0, completed=share, width=BAR_CELLS, complete_style=style, finished_style=style)
    return Text(label, no_wrap=True), bar, Text(f"{share:.2f}")


def _style(poi: PoiBelief, best: PoiBelief, person: PersonBelief) -> str:
    if poi is not best:
        return "blue"
    return "green" if person.episode_id else "cyan"
