"""`deixis eval --stage fusion`: what fusion makes of what the other stages say, and whose fault it is where it is wrong.

Keys of its JSON file are those of `fusion_summary.figures`, and stay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
from deixis_cli.options import CommandError
from deixis_fusion.config import FusionConfig
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .chosen_clips import Chosen
from .core_config import core_config
from .episode_scores import OUTCOMES, EpisodeScore
from .fusion_play import GAPS_DEG, VARIANTS, FusionScore, evaluate_fusion
from .fusion_summary import CAUSES, DEFINITION, Bin, calibration_error, faults, figures, luck, named_at, outcomes, reliability
from .json_file import write_json
from .machine import describe_machine, say_machine
from .scored_clips import score_each
from .table import COLOURS, number, percent


def check_fusion(truth: Sequence[str], sets: Mapping[str, Sequence[str]]) -> FusionConfig:
    """Read what the core is played with. Raises CommandError for what does not go with this stage alone."""
    if truth:
        raise CommandError(f"--truth {','.join(truth)}: --stage fusion plays with and without the truth anyway")
    for stage in sets:
        if stage != "fusion":
            raise CommandError(f"--set {stage}: with --stage fusion only fusion can be set")
    return core_config("fusion", FusionConfig, sets)


def run_fusion(
    chosen: Chosen, config: FusionConfig, sets: Mapping[str, Sequence[str]], json_file: Path | None, console: Console
) -> int:
    """Play, print, write. 0 when all clips were played, 1 when one was not."""
    cv2.setNumThreads(1)  # as the stages do
    scored = score_each(chosen.clips, lambda clip, on_frame: evaluate_fusion(clip, config, on_frame))
    scores = scored.scores
    if not scores:
        return scored.status()
    machine = describe_machine()
    for table in (stroke_table(scores), outcome_table(scores), gap_table(scores)):
        console.print(table)
    for line in calibration_lines(scores):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(DEFINITION, style="dim", markup=False, highlight=False)
    console.print(say_machine(machine), style="dim", markup=False, highlight=False, soft_wrap=True)
    settings = {stage: list(values) for stage, values in sets.items()}
    said = {
        "machine": machine,
        "stage": "fusion",
        "folder": str(chosen.folder),
        "seeds": chosen.seeds,
        "plain": chosen.plain,
        "settings": settings,
        "clips_left": scored.left,
    }
    clips = {score.name: _clip(score) for score in scores}
    write_json(json_file, {**said, "definitions": [DEFINITION], "summary": figures(scores), "clips": clips})
    return scored.status()


def stroke_table(scores: Sequence[FusionScore]) -> Table:
    """A row a stroke: what was answered, on what the stages said and on the truth."""
    table = Table("clip", "POI", *VARIANTS, title="Strokes", box=box.SIMPLE_HEAD, title_justify="left")
    for score in scores:
        if score.failure is not None:
            table.add_row(escape(score.name), f"[red]failed: {escape(score.failure)}")
            continue
        for rows in zip(*(score.strokes[variant] for variant in VARIANTS), strict=True):
            table.add_row(escape(score.name), f"{escape(rows[0].poi)} {rows[0].azimuth_deg:+.0f}°", *map(_answer, rows))
    return table


def outcome_table(scores: Sequence[FusionScore]) -> Table:
    """A row for each thing that fusion was given; below, whose fault it is."""
    table = Table("fusion given", title="All strokes", box=box.SIMPLE_HEAD, title_justify="left")
    for name in (*(outcome.replace("_", " ") for outcome in OUTCOMES), "false episodes"):
        table.add_column(name, justify="right")
    summary = figures(scores)
    for variant in VARIANTS:
        found = outcomes(scores, variant)
        table.add_row(variant, *(str(found[name]) for name in OUTCOMES), str(summary["false_episodes"][variant]))
    told = faults(scores)
    table.caption = "not named, by what would have: " + ", ".join(f"{cause} {told[cause]}" for cause in CAUSES)
    table.caption_justify = "left"
    return table


def gap_table(scores: Sequence[FusionScore]) -> Table:
    """Named by gap."""
    table = Table("POIs every", "named", title="Among rings of POIs", box=box.SIMPLE_HEAD, title_justify="left")
    for gap in GAPS_DEG:
        share = named_at(scores, gap)
        table.add_row(f"{gap}°", f"{percent(share.share)} of {share.total}")
    return table


def calibration_lines(scores: Sequence[FusionScore]) -> list[str]:
    """The reliability of the stated chance, and of the masses' pignistic probability: stated -> true (answers)."""
    by_luck = luck(scores)
    beside = f" (were all chances true: {by_luck.mean:.3f}, up to {by_luck.most:.3f})" if by_luck else ""
    return [
        f"ECE {_reliability(reliability(scores), beside)}",
        f"ECE by masses, which decide nothing: {_reliability(reliability(scores, by_masses=True))}",
    ]


def _reliability(bins: Sequence[Bin], beside: str = "") -> str:
    said = "  ".join(f"{one.stated:.2f} -> {one.right.share or 0.0:.2f} ({one.right.total})" for one in bins)
    return f"{number(calibration_error(bins), '', 3)}{beside}; stated -> true (answers): {said or '-'}"


def _answer(episode: EpisodeScore) -> str:
    said = ", ".join(episode.poi_ids[:3]) or ("abstained" if episode.answered else "no episode")
    return f"[{COLOURS[episode.outcome]}]{episode.outcome.replace('_', ' ')}[/] {escape(said)}"


def _clip(score: FusionScore) -> dict[str, object]:
    strokes = {
        variant: [{"poi": row.poi, "outcome": row.outcome, "answer": list(row.poi_ids), "reason": row.reason} for row in rows]
        for variant, rows in score.strokes.items()
    }
    return {"kind": score.kind, "failure": score.failure, "strokes": strokes, "false_episodes": dict(score.false)}
