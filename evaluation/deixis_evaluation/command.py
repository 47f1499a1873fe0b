"""`deixis eval`: score labelled clips (NAME.mp4 with NAME.json) by playing each through the whole system.

The clips are those of a folder, or the simulator's (`--seeds`). With `--truth` the labels answer in place of some stages: what
then becomes right was lost in these. With `--stage` one stage alone is scored, in finer detail and without the system.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError, add_lineup, read_lineup, stage_settings
from deixis_runtime.host import chosen_stages
from deixis_runtime.lineups import CLASSIC
from rich.console import Console

from .chosen_clips import Choice, Chosen, choose
from .clip_score import ClipScore
from .clips import ClipError
from .evaluate import EvaluationOptions, evaluate_clip
from .fusion_command import check_fusion, run_fusion
from .gesture_command import check_gesture, run_gesture
from .hand_confusion import write_confusion
from .headpose_command import check_headpose, run_headpose
from .headpose_report import HeadposeConditions
from .json_file import check_writable, write_json
from .machine import describe_machine, say_machine
from .report import Conditions, report
from .scored_clips import Scored, score_each
from .seeds import SeedsError
from .slices import Slice, slices_of
from .stand_ins import read_stages, say_blind
from .summary import summarise
from .table import print_scores, say_truth
from .tracker_command import check_tracker, run_tracker

TABLE_WIDTH = 150
"""Of a table that goes to a file: a terminal has its own."""
SCORED_ALONE = ("headpose", "tracker", "gesture", "fusion")
"""Stages that `--stage` knows."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("eval", help="score labelled clips", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR", help="folder with NAME.mp4 and NAME.json")
    parser.add_argument("--seeds", metavar="A:B", help="instead of DIR: the simulator's clip of each seed from A to B - 1")
    parser.add_argument("--plain", action="store_true", help="plain clips of these seeds, without difficulties")
    parser.add_argument("--kinds", type=_names, default=(), metavar="KINDS", help="these kinds of clips only, e.g. point,quiet")
    parser.add_argument("--cache", type=Path, metavar="DIR", help="where these clips are kept (default: in the user's cache)")
    parser.add_argument("--jobs", type=_jobs, metavar="J", help="how many are rendered at a time (default: one a processor)")
    parser.add_argument(
        "--stage",
        type=_stage,
        metavar="STAGE",
        help=f"score this stage alone, without starting the system: {', '.join(SCORED_ALONE)}",
    )
    parser.add_argument(
        "--truth",
        type=_stages,
        default=(),
        metavar="STAGES",
        help="the labels answer in place of these stages: headpose, gesture, tracker, or some of them with commas",
    )
    add_lineup(parser)
    parser.add_argument("--lockstep", action="store_true", help="feed a frame when the last is answered: reproducible")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="write NAME.jsonl there, one line per message published; with --stage headpose NAME.png, its answers over time",
    )
    parser.add_argument(
        "--video", type=Path, metavar="DIR", help="with --stage tracker: write NAME.mp4 there, the tracks drawn over the frames"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all scores to this file")
    parser.add_argument(
        "--confusion",
        type=Path,
        metavar="FILE",
        help="with --stage gesture: write table 1 as measured; fusion reads it (--set fusion.confusion.hand=FILE)",
    )
    parser.add_argument("--only-clips", default="*", metavar="GLOB", help="only clips whose name fits, e.g. 'c*'")
    parser.add_argument(
        "--set", action="append", default=[], dest="sets", metavar="STAGE.NAME=VALUE", help="override a setting of a stage"
    )
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Score the clips. 0 when all were played, 1 when one was not. Raises CommandError or HostFailed."""
    if given.confusion is not None and given.stage != "gesture":
        raise CommandError("--confusion: goes with --stage gesture")
    if given.video is not None and given.stage != "tracker":
        raise CommandError("--video: draws tracks, and goes with --stage tracker")
    if given.stage is None:
        return _run_system(given)
    if given.lineup != CLASSIC:
        raise CommandError("--lineup: guests are processes, and --stage scores our own core without the system")
    return RUNS_ALONE[given.stage](given)


def _run_system(given: argparse.Namespace) -> int:
    stages = chosen_stages((), given.truth)
    sets = stage_settings(given.sets)
    chosen = _choose(given)
    check_writable(given.json)
    guests = {stage: guest for stage, guest in read_lineup(given.lineup).items() if stage in stages}
    options = EvaluationOptions(stages, given.truth, given.lockstep, given.out, sets, guests=guests)
    blind = say_blind(chosen.clips, given.truth)
    if blind is not None:
        print(f"deixis eval: {blind}", file=sys.stderr)
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    scored = score_each(chosen.clips, lambda clip, on_frame: evaluate_clip(clip, options, on_frame))
    if not scored.scores:
        return scored.status()
    conditions = Conditions(chosen.folder, given.lockstep, chosen.seeds, given.truth, chosen.plain)
    return _tell(conditions, given.json, scored, slices_of(chosen.clips[: len(scored.scores)], scored.scores))


def _run_headpose(given: argparse.Namespace) -> int:
    sets = stage_settings(given.sets)
    setup = check_headpose(given.truth, sets)
    chosen = _choose(given)
    check_writable(given.json)
    conditions = HeadposeConditions(chosen.folder, chosen.seeds, given.truth, sets, chosen.plain)
    return run_headpose(chosen, setup, conditions, given.out, given.json, _console())


def _run_tracker(given: argparse.Namespace) -> int:
    if given.out is not None:
        raise CommandError("--out: --stage tracker keeps its figures in --json FILE, and draws with --video DIR")
    sets = stage_settings(given.sets)
    config = check_tracker(given.truth, sets)
    chosen = _choose(given)
    check_writable(given.json)
    return run_tracker(chosen, config, sets, given.video, given.json, _console())


def _run_gesture(given: argparse.Namespace) -> int:
    if given.out is not None:
        raise CommandError("--out: with --stage gesture nothing is drawn; --json keeps its figures")
    sets = stage_settings(given.sets)
    setup = check_gesture(given.truth, sets)
    chosen = _choose(given)
    check_writable(given.json)
    check_writable(given.confusion, "--confusion")
    scored = run_gesture(chosen, setup, sets, given.json, _console())
    if given.confusion is not None and scored.stopped is None:  # of some of the clips it would say that it is of all
        clips = f"{'plain ' * chosen.plain}seeds {chosen.seeds}" if chosen.seeds else f"clips of {chosen.folder.name}"
        strokes = [stroke for score in scored.scores for stroke in score.strokes]
        write_confusion(given.confusion, strokes, f"deixis eval --stage gesture, {clips}")
    return scored.status()


def _run_fusion(given: argparse.Namespace) -> int:
    if given.out is not None:
        raise CommandError("--out: with --stage fusion nothing is drawn; --json keeps its figures")
    sets = stage_settings(given.sets)
    config = check_fusion(given.truth, sets)
    chosen = _choose(given)
    check_writable(given.json)
    return run_fusion(chosen, config, sets, given.json, _console())


RUNS_ALONE = {"headpose": _run_headpose, "tracker": _run_tracker, "gesture": _run_gesture, "fusion": _run_fusion}
"""What scores each of SCORED_ALONE."""


def _choose(given: argparse.Namespace) -> Chosen:
    choice = Choice(given.folder, given.seeds, given.only_clips, given.kinds, given.cache, given.jobs, given.plain)
    try:
        return choose(choice, Console(stderr=True))
    except (ClipError, SeedsError) as error:
        raise CommandError(str(error)) from None


def _console() -> Console:
    console = Console()
    if not console.is_terminal:
        console.width = TABLE_WIDTH
    return console


def _tell(conditions: Conditions, json_file: Path | None, scored: Scored[ClipScore], slices: Sequence[Slice]) -> int:
    scores = scored.scores
    summary, machine, console = summarise(scores), describe_machine(), _console()
    print_scores(console, scores, summary, slices)
    if conditions.truth:
        console.print(say_truth(conditions.truth, summary), markup=False, highlight=False, soft_wrap=True)
    console.print(say_machine(machine), style="dim", markup=False, highlight=False, soft_wrap=True)
    write_json(json_file, {**report(conditions, scores, summary, slices, machine), "clips_left": scored.left})
    unanswered = [score.name for score in scores if score.failure is None and score.frames_answered < score.frames]
    if conditions.lockstep and unanswered:
        print(f"deixis eval: not reproducible, for frames went without an answer: {', '.join(unanswered)}", file=sys.stderr)
    return scored.status()


def _names(text: str) -> tuple[str, ...]:
    names = tuple(sorted({name.strip() for name in text.split(",") if name.strip()}))
    if not names or not all(name.isalnum() for name in names):
        raise argparse.ArgumentTypeError(f"'{text}': not a list of names with commas")
    return names


def _stage(text: str) -> str:
    if text not in SCORED_ALONE:
        raise argparse.ArgumentTypeError(f"'{text}' cannot be scored alone; known: {', '.join(SCORED_ALONE)}")
    return text


def _stages(text: str) -> tuple[str, ...]:
    try:
        return read_stages(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _jobs(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 64:
        raise argparse.ArgumentTypeError(f"'{text}': not a number from 1 to 64")
    return int(text)
