"""Scores on the screen: a row for each clip, the yaw bands, and the summary."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .clip_score import ClipScore
from .episode_scores import EpisodeScore
from .matching import DEFINITION
from .report import EPISODE_DEFINITION, YAW_DEFINITION
from .slices import Slice
from .summary import Summary, percentiles
from .yaw_scores import YawBand

COLOURS = {"named": "green", "in_set": "yellow", "missed": "red", "wrong": "red", "right": "green"}


def print_scores(console: Console, scores: Sequence[ClipScore], summary: Summary, slices: Sequence[Slice] = ()) -> None:
    """All of it, with the definitions of the figures."""
    console.print(clip_table(scores))
    console.print(yaw_table(summary.yaw))
    if slices:
        console.print(slice_table(slices))
    console.print(summary_table(summary))
    for definition in (EPISODE_DEFINITION, DEFINITION, YAW_DEFINITION):
        console.print(definition, style="dim", markup=False, highlight=False)


def clip_table(scores: Sequence[ClipScore]) -> Table:
    """One row for each clip."""
    table = Table(box=box.SIMPLE_HEAD, title="Clips", title_justify="left")
    table.add_column("clip", no_wrap=True)
    table.add_column("asked")
    table.add_column("POI named")
    table.add_column("side")
    for name in ("false episodes", "face", "raised hand", "yaw error", "distance error", "answered", "p95"):
        table.add_column(name, justify="right")
    for score in scores:
        table.add_row(*_clip_row(score))
    return table


def yaw_table(bands: dict[str, YawBand]) -> Table:
    """One row for each band of the true yaw. Side counts where the frontal face is out of sight, and not before."""
    table = Table(box=box.SIMPLE_HEAD, title="Head yaw, by true yaw in degrees", title_justify="left")
    for name in (
        "band",
        "frames",
        "tracking",
        "mean error",
        "off by > 20",
        "out of range",
        "said so or side right",
        "silent errors",
    ):
        table.add_column(name, justify="right")
    for name, band in bands.items():
        table.add_row(
            name.replace("_", " "),
            str(band.frames),
            percent(band.share(band.tracking)),
            number(band.mae_deg, "°"),
            percent(band.large_error_share),
            percent(band.share(band.out_of_range)),
            percent(band.share(band.said_or_side)) if name == "over_90" else "",
            percent(band.share(band.silent)),
        )
    return table


def slice_table(slices: Sequence[Slice]) -> Table:
    """One row for each slice; a trait is named in its first row."""
    table = Table(box=box.SIMPLE_HEAD, title="Strokes, by what they are", title_justify="left")
    table.add_column("trait")
    table.add_column("value")
    for name in ("clips", "strokes", "named", "in the set", "missed", "wrong", "named (95 %)"):
        table.add_column(name, justify="right")
    last = ""
    for item in slices:
        low, high = item.named_interval
        counts = (item.clips, item.strokes, *item.outcomes.values())
        table.add_row(
            "" if item.trait == last else item.trait.replace("_", " "),
            escape(item.value),
            *map(str, counts),
            f"{percent(item.named_share)} ({100 * low:.0f}-{100 * high:.0f})",
        )
        last = item.trait
    return table


def summary_table(summary: Summary) -> Table:
    """The aggregates, the headline first."""
    table = Table(box=box.SIMPLE_HEAD, title="Summary", title_justify="left", show_header=False)
    outcomes, sides, blobs = summary.outcomes, summary.sides, summary.blobs
    strokes, lateral = sum(outcomes.values()), sum(sides.values())
    share = percent(summary.clips_named / summary.pointing_clips if summary.pointing_clips else None)
    table.add_row("[bold]POI named", f"[bold]in {summary.clips_named} of {summary.pointing_clips} pointing clips ({share})")
    table.add_row(
        "strokes",
        f"{outcomes['named']} of {strokes} named, {outcomes['in_set']} in the set, {outcomes['missed']} missed, "
        f"{outcomes['wrong']} wrong",
    )
    table.add_row(
        "false episodes", f"{summary.false_quiet} in {summary.quiet_clips} quiet clips, {summary.false_pointing} in the others"
    )
    table.add_row("side", f"{sides['right']} of {lateral} right, {sides['wrong']} wrong, {sides['missed']} not said")
    table.add_row(
        "recall",
        f"faces {percent(blobs.faces.share)}, raised hands {percent(blobs.raised_hands.share)}, "
        f"all hands {percent(blobs.hands.share)}; {number(blobs.false_hands_per_frame, '', 2)} false hands a frame",
    )
    table.add_row(
        "distance", f"{number(summary.distance.error_percent, ' %')} mean error over {summary.distance.frames} frames"
    )
    latency = summary.latency_ms
    table.add_row("latency", f"p50 {number(latency['p50'], ' ms')}, p95 {number(latency['p95'], ' ms')}")
    table.add_row("frames", f"{summary.frames_answered} of {summary.frames} answered")
    if summary.failed:
        table.add_row(
            "[red]failed", f"[red]{len(summary.failed)} of {summary.clips} clips: {escape(', '.join(summary.failed))}"
        )
    return table


def say_truth(truth: Sequence[str], summary: Summary) -> str:
    """The headline of a run in which the truth stood for stages."""
    strokes = sum(summary.outcomes.values())
    return (
        f"With the true {', '.join(truth)}: POI named in {summary.clips_named} of {summary.pointing_clips} pointing clips, "
        f"{summary.outcomes['named']} of {strokes} strokes. What this run has more than one without is lost there."
    )


def percent(share: float | None) -> str:
    """A share in percent; a dash where there was nothing."""
    return "-" if share is None else f"{100 * share:.0f} %"


def number(value: float | None, unit: str, digits: int = 1) -> str:
    """A figure with its unit; a dash where there was nothing."""
    return "-" if value is None else f"{value:.{digits}f}{unit}"


def _clip_row(score: ClipScore) -> tuple[str, ...]:
    if score.failure is not None:
        return (score.name, _asked(score), f"[red]failed: {escape(score.failure)}")
    false = len(score.answers.false_episodes)
    bands = list(score.yaw.values())
    yaw = sum(bands[1:], bands[0])
    return (
        score.name,
        _asked(score),
        "\n".join(_outcome(item) for item in score.answers.episodes) or "-",
        "\n".join(_coloured(item.side or "-") for item in score.answers.episodes) or "-",
        f"[red]{false}" if false else "0",
        percent(score.blobs.faces.share),
        percent(score.blobs.raised_hands.share),
        number(yaw.mae_deg, "°"),
        number(score.distance.error_percent, " %"),
        f"{score.frames_answered}/{score.frames}",
        number(percentiles(score.latencies_ms)["p95"], " ms"),
    )


def _asked(score: ClipScore) -> str:
    return "\n".join(f"{item.poi} at {item.azimuth_deg:+.0f}°" for item in score.answers.episodes) or "nothing"


def _outcome(item: EpisodeScore) -> str:
    given = ", ".join(item.poi_ids)
    if item.outcome == "missed":
        given = "no POI given" if item.answered else "no episode"
    words = item.outcome.replace("_", " ")
    return f"[{COLOURS[item.outcome]}]{words}[/]" + ("" if item.outcome == "named" else f": {escape(given)}")


def _coloured(word: str) -> str:
    return f"[{COLOURS[word]}]{word}[/]" if word in COLOURS else word
