"""`deixis eval --stage gesture`: the gesture stage alone, on what it needs of the chain.

Keys of its JSON file are those of `gesture_summary.figures`, and stay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
from deixis_cli.options import CommandError
from deixis_gesture.config import GestureConfig
from deixis_tracker.config import TrackerConfig
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .chosen_clips import Chosen
from .core_config import core_config
from .gesture_play import GestureSetup, evaluate_gestures
from .gesture_scores import DEFINITION, GestureScore, StrokeScore
from .gesture_summary import figures, stroke_figures, summarise_gestures
from .json_file import write_json
from .machine import describe_machine, say_machine
from .proportion import Proportion
from .scored_clips import Scored, score_each
from .table import number, percent

BEFORE = "tracker"
"""The stage that gesture is fed by: the truth can stand for it, and it can be set."""


def check_gesture(truth: Sequence[str], sets: Mapping[str, Sequence[str]]) -> GestureSetup:
    """Read what the cores are played with. Raises CommandError for what does not go with this stage alone."""
    others = [stage for stage in truth if stage != BEFORE]
    if others:
        raise CommandError(f"--truth {','.join(others)}: with --stage gesture the truth can stand for {BEFORE} alone")
    played_stages = ("gesture",) if truth else (BEFORE, "gesture")
    for stage in sets:
        if stage not in played_stages:
            raise CommandError(f"--set {stage}: with --stage gesture only {' and '.join(played_stages)} are played")
    return GestureSetup(
        tracker=core_config("tracker", TrackerConfig, sets),
        gesture=core_config("gesture", GestureConfig, sets),
        true_tracks=BEFORE in truth,
    )


def run_gesture(
    chosen: Chosen, setup: GestureSetup, sets: Mapping[str, Sequence[str]], json_file: Path | None, console: Console
) -> Scored[GestureScore]:
    """Play, print, write."""
    cv2.setNumThreads(1)  # as the stages do
    scored = score_each(chosen.clips, lambda clip, on_frame: evaluate_gestures(clip, setup, on_frame))
    scores = scored.scores
    if not scores:
        return scored
    machine = describe_machine()
    console.print(table_of(scores))
    console.print(summary_of(scores))
    console.print(DEFINITION, style="dim", markup=False, highlight=False)
    console.print(say_machine(machine), style="dim", markup=False, highlight=False, soft_wrap=True)
    settings = {stage: list(values) for stage, values in sets.items()}
    said = {
        "machine": machine,
        "stage": "gesture",
        "folder": str(chosen.folder),
        "seeds": chosen.seeds,
        "plain": chosen.plain,
        "settings": settings,
        "clips_left": scored.left,
    }
    truth, clips = [BEFORE] if setup.true_tracks else [], {score.name: _clip(score) for score in scores}
    summary = {"clips": len(scores), **figures(scores)}
    write_json(json_file, {**said, "truth": truth, "definitions": [DEFINITION], "summary": summary, "clips": clips})
    return scored


def table_of(scores: Sequence[GestureScore]) -> Table:
    """A row a stroke, and one for each clip without any."""
    table = Table("clip", "stroke", "said", title="Gestures", box=box.SIMPLE_HEAD, title_justify="left")
    for name in ("probability", "bearing off", "onset", "end", "false pointings"):
        table.add_column(name, justify="right")
    for score in scores:
        if score.failure is not None:
            table.add_row(escape(score.name), f"[red]failed: {escape(score.failure)}")
            continue
        rows = [_row(stroke) for stroke in score.strokes] or [("-",) * 6]
        for number_, row in enumerate(rows):
            first = number_ == 0
            table.add_row(escape(score.name) if first else "", *row, str(len(score.false) or "") if first else "")
    return table


def summary_of(scores: Sequence[GestureScore]) -> Table:
    """All clips together."""
    summary = summarise_gestures(scores)
    table = Table(title="All clips", box=box.SIMPLE_HEAD, title_justify="left", show_header=False)
    table.add_row("pointings recognised", _share(summary.recognised))
    table.add_row("side right", _share(summary.side))
    table.add_row("bearing off (median)", number(summary.bearing_off_deg, "°"))
    table.add_row("true bearing within 68 % / 95 %", f"{_share(summary.within_68)}, {_share(summary.within_95)}")
    table.add_row("elevation off (median)", number(summary.elevation_off_deg, "°"))
    within = f"{_share(summary.elevation_within_1)}, {_share(summary.elevation_within_2)}"
    table.add_row("true elevation within 1 / 1.96 sigma", within)
    table.add_row(
        "onset / end, after the true ones (median)", f"{number(summary.onset_s, ' s', 2)}, {number(summary.end_s, ' s', 2)}"
    )
    table.add_row("false pointings", str(summary.false))
    quiet = f"{number(summary.false_per_quiet_minute, '')} ({summary.false_in_quiet} in {summary.quiet_minutes:.1f} minutes)"
    table.add_row("false pointings a minute of quiet clips", quiet)
    return table


def _row(stroke: StrokeScore) -> tuple[str, ...]:
    colour = "red" if stroke.said == "missed" else "green"
    return (
        f"person {stroke.person}, {stroke.arm or '?'} arm, {stroke.azimuth_deg:+.0f}°",
        f"[{colour}]{stroke.said}",
        "-" if stroke.probability is None else f"{stroke.probability:.2f}",
        number(stroke.bearing_off_deg, "°"),
        number(stroke.onset_s, " s", 2),
        number(stroke.end_s, " s", 2),
    )


def _share(counted: Proportion) -> str:
    interval = counted.interval
    if interval is None:
        return "-"
    return f"{percent(counted.share)} ({counted.hits} of {counted.total}; {100 * interval[0]:.0f} to {100 * interval[1]:.0f} %)"


def _clip(score: GestureScore) -> dict[str, object]:
    false = [{"person_id": one.person_id, "first": one.first, "last": one.last} for one in score.false]
    strokes = [stroke_figures(stroke) for stroke in score.strokes]
    return {"kind": score.kind, "failure": score.failure, "seconds": score.seconds, "strokes": strokes, "false": false}
