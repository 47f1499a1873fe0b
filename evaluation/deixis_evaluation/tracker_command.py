"""`deixis eval --stage tracker`: the tracker alone. Keys of its JSON file are those of `figures`, and stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
from deixis_cli.options import CommandError
from deixis_schemas.messages import Track
from deixis_tracker.config import TrackerConfig
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .blob_scores import BlobScores, Recall
from .chosen_clips import Chosen
from .clip_progress import OnFrame
from .clips import Clip, TrueFrame
from .core_config import core_config
from .json_file import write_json
from .machine import describe_machine, say_machine
from .matching import DEFINITION
from .proportion import Proportion
from .replay import Picture
from .scored_clips import score_each
from .table import number, percent
from .tracker_play import FAR_FACE_WIDTHS, TrackerScore, evaluate_tracker
from .tracker_video import VideoError, check_video, drawn_into

DEFINITIONS = (
    DEFINITION,
    f"False face: a face track farther than {FAR_FACE_WIDTHS:g} face width from every head. Side: raised hands found that are "
    "called by their right name. Switches: times at which the tracked person on a true face became another.",
)
COLUMNS = ("frames", "faces", "raised hands", "hands", "side", "false faces", "false hands", "switches", "ms a frame")


def check_tracker(truth: Sequence[str], sets: Mapping[str, Sequence[str]]) -> TrackerConfig:
    """Read what the core is played with. Raises CommandError for what does not go with this stage alone."""
    if truth:
        raise CommandError(f"--truth {','.join(truth)}: with --stage tracker there is nothing that the truth can stand for")
    for stage in sets:
        if stage != "tracker":
            raise CommandError(f"--set {stage}: with --stage tracker only tracker is played")
    return core_config("tracker", TrackerConfig, sets)


def run_tracker(
    chosen: Chosen,
    config: TrackerConfig,
    sets: Mapping[str, Sequence[str]],
    video: Path | None,
    json_file: Path | None,
    console: Console,
) -> int:
    """Play, draw into `video`, and tell. 0 when all clips were played, 1 when one was not. Raises CommandError."""
    check_video(video, chosen.clips)
    cv2.setNumThreads(1)  # as the stage does
    scored = score_each(chosen.clips, lambda clip, on_frame: _play(clip, config, video, on_frame))
    scores = scored.scores
    if not scores:
        return scored.status()
    machine = describe_machine()
    console.print(table_of(scores))
    for definition in DEFINITIONS:
        console.print(definition, style="dim", markup=False, highlight=False)
    console.print(say_machine(machine), style="dim", markup=False, highlight=False, soft_wrap=True)
    settings = {stage: list(values) for stage, values in sets.items()}
    whole = {"clips": len(scores), **figures(total_of(scores))}
    clips = {score.name: {"kind": score.kind, "failure": score.failure, **figures(score)} for score in scores}
    said = {
        "machine": machine,
        "stage": "tracker",
        "folder": str(chosen.folder),
        "seeds": chosen.seeds,
        "plain": chosen.plain,
        "settings": settings,
        "clips_left": scored.left,
    }
    write_json(json_file, {**said, "definitions": list(DEFINITIONS), "summary": whole, "clips": clips})
    return scored.status()


def _play(clip: Clip, config: TrackerConfig, video: Path | None, on_frame: OnFrame) -> TrackerScore:
    try:
        with drawn_into(video, clip) as draw:

            def on_tracks(picture: Picture, truth: TrueFrame, tracks: Sequence[Track]) -> None:
                draw(picture, truth, tracks)
                on_frame()

            return evaluate_tracker(clip, config, on_tracks)
    except VideoError as error:
        return TrackerScore(clip.name, clip.truth.meta.kind, len(clip.truth.frames), failure=str(error))


def total_of(scores: Sequence[TrackerScore]) -> TrackerScore:
    """All clips that were played as one."""
    done = [score for score in scores if score.failure is None]
    frames = sum(score.frames for score in done)
    return TrackerScore(
        "all",
        "",
        frames,
        sum((score.blobs for score in done), BlobScores()),
        sum(score.false_faces for score in done),
        Proportion(sum(score.sides.hits for score in done), sum(score.sides.total for score in done)),
        sum(score.switches for score in done),
        sum(score.cpu_ms * score.frames for score in done) / max(1, frames),
    )


def figures(score: TrackerScore) -> dict[str, Any]:
    """What the JSON file says of a clip, or of all: shares 0 to 1, null where nothing was there to find."""
    blobs = score.blobs
    return {
        "frames": score.frames,
        "faces": _recall(blobs.faces),
        "raised_hands": _recall(blobs.raised_hands),
        "hands": _recall(blobs.hands),
        "side": score.sides.share,
        "false_faces_per_frame": score.false_faces / max(1, score.frames),
        "false_hands_per_frame": blobs.false_hands_per_frame,
        "switches": score.switches,
        "cpu_ms_per_frame": score.cpu_ms,
    }


def table_of(scores: Sequence[TrackerScore]) -> Table:
    """A row for each clip, and one for all."""
    table = Table("clip", title="Tracker", box=box.SIMPLE_HEAD, title_justify="left")
    for name in COLUMNS:
        table.add_column(name, justify="right")
    for score in scores:
        if score.failure is not None:
            table.add_row(escape(score.name), f"[red]failed: {escape(score.failure)}")
        else:
            table.add_row(escape(score.name), *_row(score))
    table.add_section()
    table.add_row("all", *_row(total_of(scores)))
    return table


def _row(score: TrackerScore) -> list[str]:
    blobs, frames = score.blobs, max(1, score.frames)
    shares = (blobs.faces.share, blobs.raised_hands.share, blobs.hands.share, score.sides.share)
    false = (f"{score.false_faces / frames:.2f}", f"{blobs.false_hands / frames:.2f}")
    return [str(score.frames), *map(percent, shares), *false, str(score.switches), number(score.cpu_ms, "")]


def _recall(recall: Recall) -> dict[str, Any]:
    return {"share": recall.share, "hits": recall.found, "of": recall.total}
