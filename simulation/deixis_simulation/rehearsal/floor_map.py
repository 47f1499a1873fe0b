"""The map of a rehearsal as PNG: the site from above, the robot looking up, POIs coloured by how well they are told apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Polygon, Wedge

from .aims import Aim, close_pairs
from .confusion import Confusion, PoiResult, Verdict
from .ground import Ground, Point
from .places import FARTHEST_M, NEAREST_M, Place

INK, GREY, PAPER, VIEW = "#22303c", "#8a949c", "#ffffff", "#dfeaf3"
PLACE_COLOUR, LINK_COLOUR = "#3f6fa8", "#c8372d"
COLOURS: dict[Verdict, str] = {"told_apart": "#2f9e5b", "tied": "#e0a02a", "confused": "#d8462f", "untried": "#b3bac0"}
MEANINGS: dict[Verdict, str] = {
    "told_apart": "told apart",
    "tied": "mostly tied with others",
    "confused": "confused or not answered",
    "untried": "not tried",
}
LEGEND_WIDTH_IN, LONGEST_IN, SHORTEST_IN, DPI = 2.6, 8.5, 4.5, 130
KEY_IN = 2.2
MARGIN_M = 0.6
MOST_LINKS = 12


def draw_map(path: Path, ground: Ground, places: Sequence[Place], aims: Sequence[Aim], confusion: Confusion | None) -> None:
    """Write the PNG. Without `confusion` the map shows the geometry alone. Raises OSError where the file cannot be written."""
    left, right, bottom, top = _bounds(ground, places)
    scale = min(LONGEST_IN / max(right - left, top - bottom), 1.6)
    width, height = max((right - left) * scale, SHORTEST_IN), max((top - bottom) * scale, SHORTEST_IN)
    figure = Figure(figsize=(width + LEGEND_WIDTH_IN, height + 0.6), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)
    whole_w, whole_h = figure.get_size_inches()
    axes = figure.add_axes((0.0, 0.0, width / whole_w, height / whole_h))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.axis("off")
    _draw_view(axes, ground)
    _draw_walls(axes, ground)
    _draw_lines(axes, aims)
    _draw_links(axes, ground, aims, confusion)
    _draw_robot(axes, ground)
    _draw_places(axes, places)
    _draw_pois(axes, ground, places, confusion)
    figure.text(
        0.15 / whole_w, 1 - 0.36 / whole_h, _title(ground, confusion), fontsize=12, weight="bold", color=INK, parse_math=False
    )
    _draw_legend(figure, (width + 0.1) / whole_w, confusion)
    corner = figure.add_axes(((width + 0.2) / whole_w, 0.1 / whole_h, KEY_IN / whole_w, KEY_IN / whole_h))
    _draw_scale(corner, ground, min(width / (right - left), height / (top - bottom)))
    figure.savefig(path, format="png")


def above(point: Point) -> Point:
    """A point of the robot's frame on the sheet: the robot looks up, its left is left."""
    return -point[1], point[0]


def _title(ground: Ground, confusion: Confusion | None) -> str:
    if confusion is None or not confusion.tries:
        return ground.name
    return f"{ground.name}: {confusion.named} of {confusion.tries} pointings named"


def _bounds(ground: Ground, places: Sequence[Place]) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of what is shown, metres on the sheet."""
    points = [above((0.0, 0.0)), above(ground.camera_foot)]
    points += [above(place.position_m) for place in places] + [above(poi.on_floor) for poi in ground.pois]
    near = [above(end) for wall in ground.walls for end in wall if math.hypot(*end) < 12]
    xs, ys = [x for x, _ in points + near], [y for _, y in points + near]
    return min(xs) - MARGIN_M, max(xs) + MARGIN_M, min(ys) - MARGIN_M, max(ys) + MARGIN_M


def _draw_view(axes: Axes, ground: Ground) -> None:
    """The camera's view, and the range of distances in which people are followed."""
    middle, half = 90 + ground.camera.yaw_deg, ground.camera.horizontal_fov_deg / 2
    foot = above(ground.camera_foot)
    axes.add_patch(Wedge(foot, FARTHEST_M, middle - half, middle + half, facecolor=VIEW, edgecolor="none", zorder=0))
    axes.add_patch(
        Wedge(foot, NEAREST_M, middle - half, middle + half, facecolor=PAPER, edgecolor="none", alpha=0.7, zorder=0.1)
    )


def _draw_walls(axes: Axes, ground: Ground) -> None:
    for a, b in ground.walls:
        (x1, y1), (x2, y2) = above(a), above(b)
        axes.plot([x1, x2], [y1, y2], color=INK, linewidth=3.5, solid_capstyle="round", zorder=2)


def _draw_lines(axes: Axes, aims: Sequence[Aim]) -> None:
    """From each place to each POI that is pointed at from there; dotted where the hand leaves the picture."""
    for aim in aims:
        if aim.hidden is None:
            (x1, y1), (x2, y2) = above(aim.place.position_m), above(aim.poi.on_floor)
            style = "-" if aim.hand_in_picture else (0, (1, 2.2))
            axes.plot([x1, x2], [y1, y2], color=PLACE_COLOUR, linewidth=0.7, alpha=0.45, linestyle=style, zorder=1)


def _draw_links(axes: Axes, ground: Ground, aims: Sequence[Aim], confusion: Confusion | None) -> None:
    """Arcs between POIs that were confused; before anything was tried, between those that lie close together."""
    spots = {poi.poi_id: above(poi.on_floor) for poi in ground.pois}
    if confusion is None:
        found = list(dict.fromkeys((pair.first.poi_id, pair.second.poi_id) for pair in close_pairs(aims)))
        pairs = [(first, second, 1) for first, second in found]
    else:
        pairs = confusion.confused_pairs()
    for first, second, times in pairs[:MOST_LINKS]:
        bend = FancyArrowPatch(
            spots[first],
            spots[second],
            arrowstyle="-",
            connectionstyle="arc3,rad=0.22",
            color=LINK_COLOUR,
            linewidth=min(1.0 + times, 5.0),
            alpha=0.55,
            zorder=3,
        )
        axes.add_patch(bend)


def _draw_robot(axes: Axes, ground: Ground) -> None:
    x, y = above((0.0, 0.0))
    axes.add_patch(Polygon([(x, y + 0.24), (x - 0.17, y - 0.16), (x, y - 0.08), (x + 0.17, y - 0.16)], color=INK, zorder=5))
    foot = above(ground.camera_foot)
    axes.plot(*foot, marker="o", markersize=3, color=PAPER, zorder=6)


def _draw_places(axes: Axes, places: Sequence[Place]) -> None:
    for place in places:
        x, y = above(place.position_m)
        axes.plot(x, y, marker="o", markersize=15, color=PLACE_COLOUR, markeredgecolor=PAPER, markeredgewidth=1.5, zorder=5)
        axes.annotate(place.letter, (x, y), ha="center", va="center", fontsize=9, weight="bold", color=PAPER, zorder=6)


def _draw_pois(axes: Axes, ground: Ground, places: Sequence[Place], confusion: Confusion | None) -> None:
    """Each POI with its name on the side that looks away from the people, where no lines are."""
    results = {result.poi.poi_id: result for result in confusion.results} if confusion is not None else {}
    middle = _middle([above(place.position_m) for place in places])
    for poi in ground.pois:
        x, y = above(poi.on_floor)
        result = results.get(poi.poi_id)
        colour = COLOURS[result.verdict if result is not None else "untried"]
        axes.plot(x, y, marker="D", markersize=10, color=colour, markeredgecolor=PAPER, markeredgewidth=1.2, zorder=7)
        dx, dy = x - middle[0], y - middle[1]
        beside = abs(dx) > abs(dy)
        axes.annotate(
            f"{poi.name}{_score(result)}",
            (x, y),
            parse_math=False,  # a name may hold dollar signs
            xytext=(math.copysign(9, dx), 0) if beside else (0, math.copysign(9, dy)),
            textcoords="offset points",
            ha=("left" if dx > 0 else "right") if beside else "center",
            va="center" if beside else ("bottom" if dy > 0 else "top"),
            fontsize=8,
            color=INK,
            zorder=8,
            bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
        )


def _middle(points: Sequence[Point]) -> Point:
    return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)


def _score(result: PoiResult | None) -> str:
    return f"  {result.outcomes['named']}/{result.tries}" if result is not None and result.tries else ""


def _draw_scale(axes: Axes, ground: Ground, inches_per_m: float) -> None:
    """Length of a stretch of the sheet, and how the axes of the site's map lie on it. The axes' unit is an inch."""
    axes.set_xlim(0, KEY_IN)
    axes.set_ylim(0, KEY_IN)
    axes.axis("off")
    metres = next((length for length in (1, 2, 5, 10) if length * inches_per_m >= 0.6), 20)
    axes.plot([0.05, 0.05 + metres * inches_per_m], [0.1, 0.1], color=INK, linewidth=2, solid_capstyle="butt")
    axes.annotate(f"{metres} m", (0.05, 0.16), va="bottom", fontsize=8, color=INK)
    yaw, origin = math.radians(ground.frame.yaw_deg), (0.8, 1.0)
    for name, ahead in (("x", (math.cos(yaw), -math.sin(yaw))), ("y", (math.sin(yaw), math.cos(yaw)))):
        dx, dy = above(ahead)
        tip = (origin[0] + 0.4 * dx, origin[1] + 0.4 * dy)
        axes.add_patch(FancyArrowPatch(origin, tip, arrowstyle="-|>", mutation_scale=8, color=GREY, shrinkA=0, shrinkB=0))
        axes.annotate(name, (origin[0] + 0.52 * dx, origin[1] + 0.52 * dy), ha="center", va="center", fontsize=8, color=GREY)


def _draw_legend(figure: Figure, left: float, confusion: Confusion | None) -> None:
    handles = []
    if confusion is not None:
        handles += [_mark("D", COLOURS[verdict], 8, MEANINGS[verdict]) for verdict in COLOURS]
    else:
        handles.append(_mark("D", COLOURS["untried"], 8, "point of interest"))
    link = "confused with each other" if confusion is not None else "close together"
    handles += [
        _mark("^", INK, 9, "robot"),
        _mark("o", PLACE_COLOUR, 9, "where people stand"),
        Line2D([], [], color=PLACE_COLOUR, linewidth=1, label="pointed at"),
        Line2D([], [], color=PLACE_COLOUR, linewidth=1, linestyle=(0, (1, 2.2)), label="hand out of the picture"),
        Line2D([], [], color=LINK_COLOUR, linewidth=2.5, alpha=0.55, label=link),
        Line2D([], [], color=INK, linewidth=3.5, label="wall"),
        Line2D([], [], color=VIEW, linewidth=9, label=f"camera's view to {FARTHEST_M:g} m"),
    ]
    figure.legend(handles=handles, loc="center left", bbox_to_anchor=(left, 0.5), frameon=False, fontsize=8.5, labelspacing=0.9)


def _mark(marker: str, colour: str, size: float, label: str) -> Line2D:
    return Line2D([], [], linestyle="none", marker=marker, color=colour, markersize=size, markeredgecolor=PAPER, label=label)
