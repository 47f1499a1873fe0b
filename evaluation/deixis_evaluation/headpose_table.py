"""Scores of the headpose stage on the screen: a row for each clip, each band of yaw, and each angle's coverage."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .angle_scores import MOST_SIGMA, ONE_SIGMA, AngleScore
from .headpose_report import DEFINITIONS
from .headpose_scores import (
    HEAD_BANDS,
    LARGE_ERROR_DEG,
    HeadposeScore,
    HeadScore,
    all_samples,
    score_bands,
    score_heads,
)
from .proportion import Proportion
from .table import number, percent

ALL = "all"
SIDELESS = ("0-15", ALL)
"""Where the side says little: a head that hardly turns has none."""


def print_headpose(console: Console, scores: Sequence[HeadposeScore]) -> None:
    """All of it, with the definitions of the figures."""
    samples = all_samples(scores)
    whole, bands = score_heads(samples), score_bands(samples)
    console.print(clips_table(scores))
    console.print(bands_table(bands, whole))
    console.print(coverage_table(bands, whole))
    console.print(_say_statuses(whole), markup=False, highlight=False)
    for definition in DEFINITIONS:
        console.print(definition, style="dim", markup=False, highlight=False)


def clips_table(scores: Sequence[HeadposeScore]) -> Table:
    """One row for each clip."""
    table = _table("Clips", "clip")
    for name in ("frames", "answered", "out of range", "yaw error", "90 %", "silent", "1 σ", "1.96 σ", "pitch", "roll"):
        table.add_column(name, justify="right")
    for score in scores:
        if score.failure is not None:
            table.add_row(escape(score.name), f"[red]failed: {escape(score.failure)}")
        else:
            table.add_row(escape(score.name), *_clip_row(score_heads(score.samples)))
    return table


def bands_table(bands: dict[str, HeadScore], whole: HeadScore) -> Table:
    """One row for each band of the true yaw, shares with their intervals."""
    table = _table("Head yaw, by true yaw in degrees", "band")
    off = f"off by > {LARGE_ERROR_DEG:g}"
    for name in ("frames", "answered", "mean error", "median", "90 %", off, "silent errors", "side right"):
        table.add_column(name, justify="right")
    for name, score in {**bands, ALL: whole}.items():
        table.add_row(
            _band(name),
            str(score.frames),
            interval(score.answered),
            number(score.yaw.mae_deg, "°"),
            number(score.yaw.percentile_deg(50), "°"),
            number(score.yaw.percentile_deg(90), "°"),
            interval(score.large),
            interval(score.silent),
            "" if name in SIDELESS else interval(score.side_right),
            end_section=name == list(HEAD_BANDS)[-1],
        )
    return table


def coverage_table(bands: dict[str, HeadScore], whole: HeadScore) -> Table:
    """How often an error is within the sigma stated: yaw by band, pitch and roll over all."""
    table = _table("Coverage of the stated sigma (right are 68 % and 95 %)", "angle")
    table.add_column("true yaw")
    for name in ("frames", "mean error", "bias", "median sigma", "within 1 σ", "within 1.96 σ"):
        table.add_column(name, justify="right")
    for name, score in bands.items():
        table.add_row("yaw" if name == next(iter(bands)) else "", *_coverage_row(name, score.yaw))
    for angle, over_all in whole.angles.items():
        table.add_row("" if angle == "yaw" else angle, *_coverage_row(ALL, over_all), end_section=angle == "yaw")
    return table


def interval(counted: Proportion) -> str:
    """A share with its 95 % interval, percent; a dash where there was nothing."""
    if counted.interval is None:
        return "-"
    low, high = counted.interval
    return f"{percent(counted.share)} ({100 * low:.0f}-{100 * high:.0f})"


def _table(title: str, first: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left")
    table.add_column(first, no_wrap=True)
    return table


def _clip_row(score: HeadScore) -> tuple[str, ...]:
    out_of_range = Proportion(score.statuses["out_of_range"], score.frames)
    return (
        str(score.frames),
        percent(score.answered.share),
        percent(out_of_range.share),
        number(score.yaw.mae_deg, "°"),
        number(score.yaw.percentile_deg(90), "°"),
        percent(score.silent.share),
        percent(score.yaw.within(ONE_SIGMA).share),
        percent(score.yaw.within(MOST_SIGMA).share),
        number(score.angles["pitch"].mae_deg, "°"),
        number(score.angles["roll"].mae_deg, "°"),
    )


def _coverage_row(band: str, angle: AngleScore) -> tuple[str, ...]:
    return (
        _band(band),
        str(angle.frames),
        number(angle.mae_deg, "°"),
        "-" if angle.bias_deg is None else f"{angle.bias_deg:+.1f}°",
        number(angle.sigma_median_deg, "°"),
        interval(angle.within(ONE_SIGMA)),
        interval(angle.within(MOST_SIGMA)),
    )


def _band(name: str) -> str:
    return name.replace("_", " ")


def _say_statuses(score: HeadScore) -> str:
    counts = ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in score.statuses.items())
    return f"Status of {score.frames} frames: {counts}"
