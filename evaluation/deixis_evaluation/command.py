"""`deixis eval`: score labelled clips (NAME.mp4 with NAME.json) by playing each through the whole system."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError, stage_settings
from deixis_runtime.host import chosen_stages
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from .clip_score import ClipScore
from .clips import Clip, ClipError, load_clips
from .evaluate import EvaluationOptions, Interrupted, evaluate_clip
from .machine import describe_machine, say_machine
from .report import report
from .summary import summarise
from .table import print_scores

TABLE_WIDTH = 150
"""Of a table that goes to a file: a terminal has its own."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("eval", help="score labelled clips", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder with NAME.mp4 and NAME.json")
    parser.add_argument("--lockstep", action="store_true", help="feed a frame when the last is answered: reproducible")
    parser.add_argument("--out", type=Path, metavar="DIR", help="write NAME.jsonl there, one line per message published")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all scores to this file")
    parser.add_argument("--only-clips", default="*", metavar="GLOB", help="only clips whose name fits, e.g. 'c*'")
    parser.add_argument(
        "--set", action="append", default=[], dest="sets", metavar="STAGE.NAME=VALUE", help="override a setting of a stage"
    )
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Score the clips. 0 when all were played, 1 when one was not. Raises CommandError or HostFailed."""
    try:
        clips = load_clips(given.folder, given.only_clips)
    except ClipError as error:
        raise CommandError(str(error)) from None
    options = EvaluationOptions(
        stages=chosen_stages((), ()), lockstep=given.lockstep, out=given.out, sets=stage_settings(given.sets)
    )
    _check_writable(given.json)
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    try:
        scores = _evaluate(clips, options)
    except Interrupted as interrupt:
        print(f"deixis eval: {interrupt} before the end", file=sys.stderr)
        return 128 + interrupt.signal
    return _tell(given, scores)


def _evaluate(clips: Sequence[Clip], options: EvaluationOptions) -> list[ClipScore]:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("frames"), TimeRemainingColumn())
    scores = []
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("", total=sum(len(clip.truth.frames) for clip in clips))
        played = 0
        for number, clip in enumerate(clips, 1):
            progress.update(task, description=f"{clip.name} ({number} of {len(clips)})")
            score = evaluate_clip(clip, options, lambda: progress.advance(task))
            if score.failure is not None:
                progress.console.print(f"{clip.name}: {score.failure}", style="red", markup=False)
            scores.append(score)
            # Frames that were not answered are done with, too.
            played += len(clip.truth.frames)
            progress.update(task, completed=played)
    return scores


def _tell(given: argparse.Namespace, scores: Sequence[ClipScore]) -> int:
    summary, machine = summarise(scores), describe_machine()
    console = Console()
    if not console.is_terminal:
        console.width = TABLE_WIDTH
    print_scores(console, scores, summary)
    console.print(say_machine(machine), style="dim", markup=False, highlight=False, soft_wrap=True)
    if given.json is not None:
        content = report(given.folder, scores, summary, machine, lockstep=given.lockstep)
        given.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    unanswered = [score.name for score in scores if score.failure is None and score.frames_answered < score.frames]
    if given.lockstep and unanswered:
        print(f"deixis eval: not reproducible, for frames went without an answer: {', '.join(unanswered)}", file=sys.stderr)
    if summary.failed:
        print(f"deixis eval: {len(summary.failed)} of {summary.clips} clips were not played", file=sys.stderr)
        return 1
    return 0


def _check_writable(path: Path | None) -> None:
    """Refuse before an hour of work what cannot be written after it. Raises CommandError."""
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("a", encoding="utf-8").close()
    except OSError as error:
        raise CommandError(f"--json {path}: {error.strerror}") from None
