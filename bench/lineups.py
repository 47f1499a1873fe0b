"""Line-ups beside each other: accuracy, processor time and memory of our stages and of the guests in their place.

usage: python bench/lineups.py [--lineups NAMES] [--clips DIR] [--only-clips GLOB] [--grey GLOB] [--panned GLOB] [--pan-px N]
       [--signers DIR] [--only-signers GLOB] [--json FILE]

Each line-up plays, through the whole system in lockstep (`deixis eval --lineup NAME` does the same with clips):
* labelled clips: POIs named, faces and hands found, yaw errors, false episodes;
* --grey: those of them that fit the pattern once more without colour;
* --panned: those that fit it once more from a robot that turns, by --pan-px pixels a frame, and tells fusion so;
* people who sign and never point (../shared/data/asl_clips, where it is there): frames with a face and with a yaw, hands a
  frame, and episodes a minute, each of them false.
cpu_ms: processor time a frame of tracker, headpose and gesture, without what they take to start; pss_mb: what the three held at
most, pages that are shared counted by their share. Guests have to be there: make guests.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from changed_clips import greyed, panned
from deixis_cli.options import quoted
from deixis_cli.play import play
from deixis_evaluation.clip_score import ClipScore
from deixis_evaluation.clips import Clip, ClipError, load_clips
from deixis_evaluation.evaluate import EvaluationOptions, evaluate_clip
from deixis_evaluation.interrupted import Interrupted
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_evaluation.summary import Summary, summarise
from deixis_runtime.host import HostOptions
from deixis_runtime.lineups import LINEUPS, LineupError, guests_of
from deixis_schemas import topics
from deixis_schemas.messages import HeadPoses, Message, Target, Tracks
from lineup_meter import Meter, StageCost
from rich import box
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
CLIPS = ROOT / "examples" / "clips"
SIGNERS = ROOT.parent / "shared" / "data" / "asl_clips"
REPLACED = ("tracker", "headpose", "gesture")
FPS = 30.0
RUN_WITHIN_S = 600.0
Figures = dict[str, float | None]


@dataclass
class Signers:
    """Counts over the frames of people who sign."""

    frames: int = 0
    faces: int = 0
    yaws: int = 0
    hands: int = 0
    episodes: int = 0
    failed: int = 0

    def hear(self, message: Message) -> None:
        """The next message."""
        if isinstance(message, Tracks):
            self.frames += 1
            self.faces += any(track.kind == "face" and track.observed for track in message.tracks)
            self.hands += sum(track.kind in ("left_hand", "right_hand") and track.observed for track in message.tracks)
        elif isinstance(message, HeadPoses):
            self.yaws += any(pose.status in ("tracking", "out_of_range") for pose in message.poses)
        elif isinstance(message, Target):
            self.episodes += message.final

    def figures(self) -> Figures:
        """By name."""
        if not self.frames:
            return {}
        return {
            "signers_faces": self.faces / self.frames,
            "signers_yaws": self.yaws / self.frames,
            "signers_hands_a_frame": self.hands / self.frames,
            "signers_false_a_minute": 60 * FPS * self.episodes / self.frames,
        }


def measure(lineup: str, clips: Sequence[Clip], changed: Mapping[str, Sequence[Clip]], signers: Sequence[Path]) -> Figures:
    """All figures of a line-up. changed: clips as another camera takes them, by what is changed. Raises LineupError."""
    guests, meter = guests_of(lineup), Meter()
    figures = _clip_figures(score(clips, guests, meter))
    for name, others in changed.items():
        figures |= _changed_figures(name, score(others, guests, Meter())) if others else {}
    said = sign(signers, guests, meter)
    figures |= said.figures()
    figures["not_played"] = (figures["not_played"] or 0.0) + said.failed
    costs = {stage: meter.stages.get(stage, StageCost()) for stage in REPLACED}
    for stage, cost in costs.items():
        figures |= {f"cpu_ms_{stage}": cost.cpu_ms, f"pss_mb_{stage}": cost.pss_mb}
    figures["cpu_ms"] = sum(cost.cpu_ms or 0.0 for cost in costs.values())
    figures["pss_mb"] = sum(cost.pss_mb for cost in costs.values())
    return figures


def score(clips: Sequence[Clip], guests: dict[str, str], meter: Meter) -> list[ClipScore]:
    """The scores of labelled clips; one that could not be played is said and counts as not answered."""
    options, scores = EvaluationOptions(topics.STAGES, lockstep=True, guests=guests), []
    for clip in clips:
        meter.begin()
        scores.append(evaluate_clip(clip, options, on_message=meter.hear))
        if scores[-1].failure is not None:
            print(f"bench/lineups: {clip.name}: {scores[-1].failure}", file=sys.stderr)
    return scores


def sign(clips: Sequence[Path], guests: dict[str, str], meter: Meter) -> Signers:
    """What is said of people who sign; a clip that could not be played is said and counted."""
    counts = Signers()
    for clip in clips:
        meter.begin()

        def hear(_: str, message: Message) -> None:
            meter.hear(message)
            counts.hear(message)

        with tempfile.TemporaryDirectory(prefix="deixis-lineups-") as folder:
            source, registry = (quoted(str(path)) for path in (clip, Path(folder) / "pois.sqlite"))
            sets: dict[str, tuple[str, ...]] = {"camera": (f"source={source}",), "fusion": (f"registry={registry}",)}
            host = HostOptions(robot="lineups", stages=topics.STAGES, listen=(), lockstep=True, sets=sets, guests=guests)
            result = play(host, on_message=hear, timeout_s=RUN_WITHIN_S)
        if result.failure is not None or result.signal is not None:
            counts.failed += 1
            print(f"bench/lineups: {clip.name}: {result.failure or 'stopped'}", file=sys.stderr)
    return counts


def _changed_figures(name: str, scores: list[ClipScore]) -> Figures:
    summary = summarise(scores)
    return {
        f"{name}_pointing": float(summary.pointing_clips),
        f"{name}_named": float(summary.clips_named),
        f"{name}_false_episodes": float(summary.false_quiet + summary.false_pointing),
        f"{name}_faces": summary.blobs.faces.share,
        f"{name}_raised_hands": summary.blobs.raised_hands.share,
        f"{name}_false_hands_a_frame": summary.blobs.false_hands_per_frame,
    }


def _clip_figures(scores: list[ClipScore]) -> Figures:
    summary: Summary = summarise(scores)
    bands = {f"yaw_mae_{name}": band.mae_deg for name, band in summary.yaw.items()}
    answered = {
        f"yaw_answered_{name}": (band.tracking + band.out_of_range) / band.frames if band.frames else None
        for name, band in summary.yaw.items()
    }
    return {
        "clips": float(summary.clips),
        "not_played": float(len(summary.failed)),
        "clips_pointing": float(summary.pointing_clips),
        "clips_named": float(summary.clips_named),
        "false_episodes": float(summary.false_quiet + summary.false_pointing),
        "faces": summary.blobs.faces.share,
        "raised_hands": summary.blobs.raised_hands.share,
        "hands": summary.blobs.hands.share,
        "false_hands_a_frame": summary.blobs.false_hands_per_frame,
        **bands,
        **answered,
        "distance_off_percent": summary.distance.error_percent,
    }


def table_of(measured: dict[str, Figures]) -> Table:
    """One row for each figure, one column for each line-up."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("figure")
    for name in measured:
        table.add_column(name, justify="right")
    names = dict.fromkeys(name for figures in measured.values() for name in figures)
    for name in names:
        table.add_row(name.replace("_", " "), *(_said(figures.get(name)) for figures in measured.values()))
    return table


def _said(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if float(value).is_integer() and value > 1 else f"{value:.2f}" if value < 10 else f"{value:.1f}"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lineups", default=",".join(LINEUPS), metavar="NAMES", help="default: %(default)s")
    parser.add_argument("--clips", type=Path, default=CLIPS, metavar="DIR", help="labelled clips (default: those that ship)")
    parser.add_argument("--only-clips", default="*", metavar="GLOB", help="only clips whose name fits")
    parser.add_argument("--grey", default="pointing", metavar="GLOB", help="clips to play without colour, too ('' for none)")
    parser.add_argument("--panned", default="pointing", metavar="GLOB", help="clips to play panned, too ('' for none)")
    parser.add_argument("--pan-px", type=int, default=2, metavar="N", help="pixels a frame (default: %(default)s)")
    parser.add_argument("--signers", type=Path, default=SIGNERS, metavar="DIR", help="people who sign (default: %(default)s)")
    parser.add_argument("--only-signers", default="*", metavar="GLOB", help="only those whose name fits")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    os.environ.setdefault("DEIXIS_LOG", "ERROR")
    said, measured = Console(stderr=True), {}
    signers = sorted(given.signers.glob(f"{given.only_signers}.mkv"))
    if not signers:
        said.print(f"signers: left out, for there are none in '{given.signers}'", style="yellow", markup=False, soft_wrap=True)
    try:
        clips = load_clips(given.clips, given.only_clips)
        to_grey, to_pan = (load_clips(given.clips, glob) if glob else [] for glob in (given.grey, given.panned))
        with greyed(to_grey) as grey, panned(to_pan, given.pan_px) as pan:
            for name in given.lineups.split(","):
                said.print(f"{name} ...", markup=False)
                measured[name] = measure(name, clips, {"grey": grey, "panned": pan}, signers)
                _write(given.json, measured)
    except (ClipError, LineupError, Interrupted) as error:
        print(f"bench/lineups: {error}", file=sys.stderr)
        return 1
    console = Console()
    if not console.is_terminal:
        console.width = 150
    console.print(table_of(measured))
    console.print(say_machine(describe_machine()), highlight=False, markup=False, soft_wrap=True)
    return 0


def _write(path: Path | None, measured: dict[str, Figures]) -> None:
    """After each line-up: a whole run takes half an hour."""
    if path is None:
        return
    flat = {f"{lineup}_{name}": value for lineup, figures in measured.items() for name, value in figures.items()}
    path.write_text(json.dumps({"machine": describe_machine(), "figures": flat}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
