"""`deixis eval`: score labelled clips (NAME.mp4 with NAME.json) by playing each through the whole system.

The clips are those of a folder, or the simulator's (`--seeds`). With `--truth` the labels answer in place of some stages: what
then becomes right was lost in these.
"""

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

from .chosen_clips import Choice, choose
from .clip_score import ClipScore
from .clips import Clip, ClipError
from .evaluate import EvaluationOptions, Interrupted, evaluate_clip
from .machine import describe_machine, say_machine
from .report import Conditions, report
from .seeds import SeedsError
from .slices import Slice, slices_of
from .stand_ins import read_stages, say_blind
from .summary import summarise
from .table import print_scores, say_truth

TABLE_WIDTH = 150
"""Of a table that goes to a file: a terminal has its own."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("eval", help="score labelled clips", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR", help="folder with NAME.mp4 and NAME.json")
    parser.add_argument("--seeds", metavar="A:B", help="instead of DIR: the simulator's clip of each seed from A to B - 1")
    parser.add_argument("--kinds", type=_names, default=(), metavar="KINDS", help="these kinds of clips only, e.g. point,quiet")
    parser.add_argument("--cache", type=Path, metavar="DIR", help="where these clips are kept (default: in the user's cache)")
    parser.add_argument("--jobs", type=_jobs, metavar="J", help="how many are rendered at a time (default: one a processor)")
    parser.add_argument(
        "--truth",
        type=_stages,
        default=(),
        metavar="STAGES",
        help="the labels answer in place of these stages: headpose, gesture, tracker, or some of them with commas",
    )
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
    choice = Choice(given.folder, given.seeds, given.only_clips, given.kinds, given.cache, given.jobs)
    stages = chosen_stages((), given.truth)
    sets = stage_settings(given.sets)
    try:
        chosen = choose(choice, Console(stderr=True))
    except (ClipError, SeedsError) as error:
        raise CommandError(str(error)) from None
    _check_writable(given.json)
    options = EvaluationOptions(stages, given.truth, given.lockstep, given.out, sets)
    blind = say_blind(chosen.clips, given.truth)
    if blind is not None:
        print(f"deixis eval: {blind}", file=sys.stderr)
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    try:
        scores = _evaluate(chosen.clips, options)
    except Interrupted as interrupt:
        print(f"deixis eval: {interrupt} before the end", file=sys.stderr)
        return 128 + interrupt.signal
    conditions = Conditions(chosen.folder, given.lockstep, chosen.seeds, given.truth)
    return _tell(conditions, given.json, scores, slices_of(chosen.clips, scores))


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


def _tell(conditions: Conditions, json_file: Path | None, scores: Sequence[ClipScore], slices: Sequence[Slice]) -> int:
    summary, machine = summarise(scores), describe_machine()
    console = Console()
    if not console.is_terminal:
        console.width = TABLE_WIDTH
    print_scores(console, scores, summary, slices)
    if conditions.truth:
        console.print(say_truth(conditions.truth, summary), markup=False, highlight=False, soft_wrap=True)
    console.print(say_machine(machine), style="dim", markup=False, highlight=False, soft_wrap=True)
    if json_file is not None:
        content = report(conditions, scores, summary, slices, machine)
        json_file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    unanswered = [score.name for score in scores if score.failure is None and score.frames_answered < score.frames]
    if conditions.lockstep and unanswered:
        print(f"deixis eval: not reproducible, for frames went without an answer: {', '.join(unanswered)}", file=sys.stderr)
    if summary.failed:
        print(f"deixis eval: {len(summary.failed)} of {summary.clips} clips were not played", file=sys.stderr)
        return 1
    return 0


def _names(text: str) -> tuple[str, ...]:
    names = tuple(sorted({name.strip() for name in text.split(",") if name.strip()}))
    if not names or not all(name.isalnum() for name in names):
        raise argparse.ArgumentTypeError(f"'{text}': not a list of names with commas")
    return names


def _stages(text: str) -> tuple[str, ...]:
    try:
        return read_stages(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _jobs(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 64:
        raise argparse.ArgumentTypeError(f"'{text}': not a number from 1 to 64")
    return int(text)


def _check_writable(path: Path | None) -> None:
    """Refuse before an hour of work what cannot be written after it. Raises CommandError."""
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("a", encoding="utf-8").close()
    except OSError as error:
        raise CommandError(f"--json {path}: {error.strerror}") from None
