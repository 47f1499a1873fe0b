"""A clip's heads as PNG: the yaw stated with its sigma against the true one over the frames, and the status below it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from .head_samples import ABSENT, HeadSample
from .headpose_scores import HeadposeScore, score_heads

INK, GREY, PAPER = "#22303c", "#8a949c", "#ffffff"
TRUE_COLOUR, STATED_COLOUR = "#22303c", "#c8372d"
COLOURS = {"tracking": "#2f9e5b", "out_of_range": "#e0a02a", "initialising": "#6f9fd0", "lost": "#d8462f", ABSENT: "#d5d9dd"}
LABELS = {"out_of_range": "out of range (side shaded)"}
OUT_OF_RANGE_FROM_DEG = 100.0
"""Where the side said is drawn, in place of an angle that is not."""
SIDE_SHOWN_DEG = {"left": 135.0, "right": -135.0}
"""A panel reaches so far where a side is said, be it the wrong one."""
WIDTH_IN, PERSON_IN, HEADER_IN, FOOTER_IN, DPI = 10.0, 3.2, 0.5, 0.7, 110
WRAP_DEG, TICK_DEG = 180.0, 30.0
LONGEST_TITLE = 78
"""Letters that fit; a longer one is set smaller."""
STRIP = 0.06
"""Height of the strip of status, by that of a person's panel."""
Floats = NDArray[np.float64]


def draw_heads(path: Path, score: HeadposeScore) -> None:
    """Draw all persons of a clip, one panel each. Raises OSError where the file cannot be written."""
    persons = sorted({item.person for item in score.samples})
    height = HEADER_IN + FOOTER_IN + PERSON_IN * max(len(persons), 1)
    figure = Figure(figsize=(WIDTH_IN, height), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)
    title = _title(score)
    size = min(12.0, 12.0 * LONGEST_TITLE / len(title))
    figure.text(0.08, 1 - 0.32 / height, title, fontsize=size, weight="bold", color=INK, parse_math=False)
    for row, person in enumerate(persons):
        samples = [item for item in score.samples if item.person == person]
        bottom = (FOOTER_IN + PERSON_IN * (len(persons) - 1 - row) + 0.25) / height
        yaw, strip = _panels(figure, bottom, (PERSON_IN - 0.35) / height)
        _draw_yaw(yaw, samples, score.frames)
        _draw_strip(strip, samples)
        for axes in (yaw, strip):
            axes.set_xlim(-0.5, score.frames - 0.5)
        yaw.set_ylabel(f"yaw of person {person}, degrees" if len(persons) > 1 else "yaw, degrees", color=INK)
        if row == len(persons) - 1:
            strip.set_xlabel("frame", color=INK)
    if persons:
        _draw_legend(figure)
    else:
        figure.text(0.5, 0.5, "no head is in the picture", ha="center", color=GREY)
    figure.savefig(path, format="png")


def _title(score: HeadposeScore) -> str:
    heads = score_heads(score.samples)
    if heads.yaw.mae_deg is None:
        return f"{score.name}: no yaw stated"
    answered = heads.answered.share or 0.0
    return f"{score.name}: yaw off by {heads.yaw.mae_deg:.1f}° (MAE), {100 * answered:.0f} % of frames answered"


def _panels(figure: Figure, bottom: float, height: float) -> tuple[Axes, Axes]:
    gap = 0.02 * height
    strip = figure.add_axes((0.08, bottom, 0.9, STRIP * height))
    top = bottom + STRIP * height + gap
    return figure.add_axes((0.08, top, 0.9, height * (1 - STRIP) - gap)), strip


def _draw_yaw(axes: Axes, samples: Sequence[HeadSample], frames: int) -> None:
    true = _over_time([(item.frame, item.true.yaw) for item in samples], frames)
    stated = _over_time([(item.frame, item.tracked.yaw_deg) for item in samples if item.tracked], frames)
    sigma = _over_time([(item.frame, item.sigma_deg("yaw")) for item in samples], frames)
    sides = [item.side for item in samples if item.status == "out_of_range"]
    shown = [edge for side, edge in SIDE_SHOWN_DEG.items() if side in sides]
    low, high = _limits(np.concatenate([true, stated, shown]))
    at, middle, spread = broken(stated, sigma)
    for times, alpha in ((2, 0.14), (1, 0.22)):
        edges = middle - times * spread, middle + times * spread
        axes.fill_between(at, *edges, color=STATED_COLOUR, alpha=alpha, linewidth=0)
    _draw_sides(axes, samples, low, high)
    axes.plot(*broken(true), color=TRUE_COLOUR, linewidth=1.6)
    axes.plot(at, middle, color=STATED_COLOUR, linewidth=1.4)
    axes.set_ylim(low, high)
    axes.yaxis.set_major_locator(MultipleLocator(TICK_DEG if high - low > 3 * TICK_DEG else TICK_DEG / 3))
    axes.axhline(0, color=GREY, linewidth=0.6, zorder=0)
    axes.set_axisbelow(True)
    axes.grid(axis="y", color="#e6e9ec", linewidth=0.6)
    axes.tick_params(labelbottom=False, bottom=False, colors=INK, labelsize=8)
    _frame(axes)


def _draw_sides(axes: Axes, samples: Sequence[HeadSample], low: float, high: float) -> None:
    """Where a head is said to be out of range, the range of yaw that this leaves."""
    frames = np.array([item.frame for item in samples], np.float64)
    for side, edges in {"left": (OUT_OF_RANGE_FROM_DEG, WRAP_DEG), "right": (-WRAP_DEG, -OUT_OF_RANGE_FROM_DEG)}.items():
        said = np.array([item.status == "out_of_range" and item.side == side for item in samples])
        bottom, top = max(edges[0], low), min(edges[1], high)
        if said.any() and bottom < top:
            axes.fill_between(
                frames, bottom, top, where=said.tolist(), step="mid", color=COLOURS["out_of_range"], alpha=0.3, linewidth=0
            )


def _draw_strip(axes: Axes, samples: Sequence[HeadSample]) -> None:
    for item in samples:
        axes.axvspan(item.frame - 0.5, item.frame + 0.5, color=COLOURS[item.status], linewidth=0)
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.tick_params(colors=INK, labelsize=8)
    _frame(axes)


def _over_time(values: Sequence[tuple[int, float | None]], frames: int) -> Floats:
    """A value for each frame of the clip, NaN where there is none: a line has a gap there."""
    line = np.full(frames, np.nan)
    for frame, value in values:
        line[frame] = np.nan if value is None else value
    return line


def broken(angles: Floats, *others: Floats) -> tuple[Floats, ...]:
    """Frame, angle and others with a gap where the angle passes from 180 to -180: drawn through, it would be a turn."""
    leaps = np.flatnonzero(np.abs(np.diff(angles)) > WRAP_DEG) + 1
    return tuple(np.insert(line, leaps, np.nan) for line in (np.arange(len(angles), dtype=np.float64), angles, *others))


def _limits(known: Floats) -> tuple[float, float]:
    """Of the panel: all yaw in it, in steps of a tick, and never so near that noise fills it."""
    low, high = min(float(np.nanmin(known)) - 8, -TICK_DEG), max(float(np.nanmax(known)) + 8, TICK_DEG)
    return max(TICK_DEG * np.floor(low / TICK_DEG), -WRAP_DEG), min(TICK_DEG * np.ceil(high / TICK_DEG), WRAP_DEG)


def _frame(axes: Axes) -> None:
    for spine in axes.spines.values():
        spine.set_color("#c9cfd4")
        spine.set_linewidth(0.8)


def _draw_legend(figure: Figure) -> None:
    lines = [
        Line2D([], [], color=TRUE_COLOUR, linewidth=1.6, label="true yaw"),
        Line2D([], [], color=STATED_COLOUR, linewidth=1.4, label="yaw stated"),
        Patch(color=STATED_COLOUR, alpha=0.33, linewidth=0, label="1 sigma"),
        Patch(color=STATED_COLOUR, alpha=0.14, linewidth=0, label="2 sigma"),
    ]
    statuses = [Patch(color=colour, linewidth=0, label=LABELS.get(status, status)) for status, colour in COLOURS.items()]
    legend = figure.legend(
        handles=lines + statuses, loc="lower center", ncol=9, frameon=False, fontsize=8, columnspacing=1.2, handlelength=1.6
    )
    for text in legend.get_texts():
        text.set_color(INK)
