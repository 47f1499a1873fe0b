"""`deixis eval --stage headpose`: the headpose stage alone, on what it needs of the chain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import cv2
from deixis_cli.options import CommandError
from deixis_headpose.config import HeadposeConfig
from deixis_tracker.config import TrackerConfig
from rich.console import Console

from .chosen_clips import Chosen
from .clip_progress import OnFrame
from .clips import Clip
from .core_config import core_config
from .headpose_play import HeadposeSetup, evaluate_heads
from .headpose_report import HeadposeConditions, headpose_report
from .headpose_scores import HeadposeScore
from .headpose_table import print_headpose
from .json_file import write_json
from .machine import describe_machine, say_machine
from .scored_clips import score_each

BEFORE = "tracker"
"""The stage that headpose is fed by: the truth can stand for it, and it can be set."""
Draw = Callable[[Path, HeadposeScore], None]


def check_headpose(truth: Sequence[str], sets: Mapping[str, Sequence[str]]) -> HeadposeSetup:
    """Read what the cores are played with. Raises CommandError for what does not go with this stage alone."""
    others = [stage for stage in truth if stage != BEFORE]
    if others:
        raise CommandError(f"--truth {','.join(others)}: with --stage headpose the truth can stand for {BEFORE} alone")
    played_stages = ("headpose",) if truth else (BEFORE, "headpose")
    for stage in sets:
        if stage not in played_stages:
            raise CommandError(f"--set {stage}: with --stage headpose only {' and '.join(played_stages)} are played")
    return HeadposeSetup(
        tracker=core_config("tracker", TrackerConfig, sets),
        headpose=core_config("headpose", HeadposeConfig, sets),
        true_tracks=BEFORE in truth,
    )


def run_headpose(
    chosen: Chosen,
    setup: HeadposeSetup,
    conditions: HeadposeConditions,
    out: Path | None,
    json_file: Path | None,
    console: Console,
) -> int:
    """Play, draw into `out`, and tell. 0 when all clips were played, 1 when one was not. Raises CommandError."""
    draw = drawer(out)
    cv2.setNumThreads(1)  # as the stages do

    def score(clip: Clip, on_frame: OnFrame) -> HeadposeScore:
        found = evaluate_heads(clip, setup, on_frame)
        if found.failure is None and out is not None:
            draw(out / f"{clip.name}.png", found)
        return found

    scored = score_each(chosen.clips, score)
    scores = scored.scores
    if not scores:
        return scored.status()
    machine = describe_machine()
    print_headpose(console, scores)
    console.print(say_machine(machine), style="dim", markup=False, highlight=False, soft_wrap=True)
    write_json(json_file, {**headpose_report(conditions, scores, machine), "clips_left": scored.left})
    return scored.status()


def drawer(out: Path | None) -> Draw:
    """What draws a clip; the folder is made. Matplotlib is loaded here alone. Raises CommandError where it cannot be done."""
    if out is None:
        return lambda _path, _score: None
    try:
        out.mkdir(parents=True, exist_ok=True)
        from .headpose_plot import draw_heads  # noqa: PLC0415
    except OSError as error:
        raise CommandError(f"--out {out}: {error.strerror}") from None
    except ImportError as error:
        hint = "pip install 'deixis-evaluation[plots]'"
        raise CommandError(f"--out draws with matplotlib, which cannot be loaded: {error} ({hint})") from None
    return draw_heads
