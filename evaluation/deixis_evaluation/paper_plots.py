"""Figures 5 to 8 as PNG: hand and head around a person, figure 6, and the rooms with arrangements in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from deixis_fusion.confusion import HeadConfusion
from deixis_fusion.pointing import region_of
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle, Wedge

from .paper_arrangements import Arrangements
from .paper_rooms import ROOM_A, ROOM_B, ROOM_C, Room
from .paper_simulation import Simulation, Study

INK, GREY, PAPER, VISIBLE = "#22303c", "#9aa4ac", "#ffffff", "#2f9e5b"
HAND, FACE = "#3f7cc4", "#e0a02a"
DPI = 120
DARK = 75.0
"""Of figure 6, per cent: letters are light on such a cell."""
FIGURE_5_POIS_DEG = (15.0, -20.0, -60.0, -110.0, -165.0, 125.0, 75.0, 170.0)
"""Of figure 5's eight POIs: two in each of the regions beside the person, four in front and behind."""
NOTE = "reconstruction: the paper's own numbers and plans are not published"


def draw_figures(out: Path, study: Study) -> None:
    """Write fig5.png to fig8.png. Raises OSError where that cannot be done."""
    simulation = Simulation(study)
    draw_figure_5(out / "fig5.png", study)
    draw_figure_6(out / "fig6.png", study.config.confusion.head)
    halls = [(room, simulation.arrangements(room, (index, 0), 1)) for index, room in enumerate((ROOM_A, ROOM_B))]
    draw_rooms(out / "fig7.png", halls, "Figure 7: experiments A and B, one arrangement in each")
    draw_rooms(
        out / "fig8.png", [(ROOM_C, drawn) for drawn in _three_and_two(simulation)], "Figure 8: experiment C, two arrangements"
    )


def draw_figure_5(path: Path, study: Study) -> None:
    """What hand and head can tell, around a person who faces the robot (up)."""
    paper = study.config.paper
    figure, (axes,) = _figure(7.4, 6.6, 1, "Figure 5: two sources around a person who faces the robot")
    axes.set_xlim(-1.6, 1.6)
    axes.set_ylim(-1.25, 1.4)
    for low, high in ((paper.phi_h_min_deg, paper.phi_h_max_deg), (-paper.phi_h_max_deg, -paper.phi_h_min_deg)):
        axes.add_patch(Wedge((0, 0), 1.0, low + 90, high + 90, color=HAND, alpha=0.22, linewidth=0))
    head = (90 - paper.phi_f_max_deg, 90 + paper.phi_f_max_deg)
    axes.add_patch(Wedge((0, 0), 0.55, *head, color=FACE, alpha=0.35, linewidth=0))
    axes.add_patch(Circle((0, 0), 1.0, fill=False, color=GREY, linewidth=0.8))
    axes.add_patch(Circle((0, 0), 0.06, color=VISIBLE))
    axes.add_patch(Rectangle((-0.08, 1.16), 0.16, 0.12, color=VISIBLE))
    axes.text(0.14, 1.22, "robot", va="center", color=INK, fontsize=9)
    for i, bearing in enumerate(FIGURE_5_POIS_DEG, 1):
        x, y = _toward(bearing)
        axes.plot([x], [y], "o", color=INK, markersize=6)
        region = region_of(bearing, (paper.phi_h_min_deg, paper.phi_h_max_deg))
        side = f"P{i}: {region}" + ("" if abs(bearing) <= paper.phi_f_max_deg else ",\nbeyond the head")
        align = "left" if x > 0 else "right"
        axes.text(1.1 * x, 1.1 * y, side, ha=align, va="center", color=INK, fontsize=9)
    for bearing, name in ((90.0, "$m_{h-L}$"), (-90.0, "$m_{h-R}$"), (0.0, "$m_{h-C}$"), (180.0, "$m_{h-C}$")):
        x, y = _toward(bearing)
        axes.text(0.77 * x, 0.77 * y, name, ha="center", va="center", color=HAND, fontsize=12)
    axes.text(0.0, 0.3, "$m_f(\\{P_i\\})$", ha="center", va="center", color="#9a6a10", fontsize=12)
    axes.text(0.0, -0.35, "$m_{f-O}$", ha="center", va="center", color="#9a6a10", fontsize=12)
    hand = f"hand recognised: {paper.phi_h_min_deg:g} to {paper.phi_h_max_deg:g}°"
    caption = f"blue: {hand} to either side; yellow: head computed to {paper.phi_f_max_deg:g}°"
    figure.text(0.5, 0.03, caption, ha="center", color=INK, fontsize=9)
    figure.savefig(path, format="png")


def draw_figure_6(path: Path, confusion: HeadConfusion) -> None:
    """The confusion matrix with its row "not computed", in per cent."""
    table = 100 * np.array([*confusion.table, confusion.not_computed])
    rows, columns = table.shape
    figure, (axes,) = _figure(10.5, 7.6, 1, "Figure 6: perceived face orientation (rows) for the intended one (columns), %")
    axes.set_aspect("auto")
    axes.imshow(table, cmap="Blues", vmin=0, vmax=130, aspect="auto")
    for row in range(rows):
        for column in range(columns):
            if table[row, column] >= 0.05:
                text = f"{table[row, column]:.3g}"
                axes.text(
                    column, row, text, ha="center", va="center", fontsize=7.5, color=PAPER if table[row, column] > DARK else INK
                )
    axes.set_xticks(range(columns), [f"{angle:g}°" for angle in confusion.intended_deg], fontsize=8, color=INK)
    names = [*(f"{angle:g}°" for angle in confusion.perceived_deg), "not computed"]
    axes.set_yticks(range(rows), names, fontsize=8, color=INK)
    axes.tick_params(length=0)
    axes.axhline(rows - 1.5, color=INK, linewidth=0.8)
    axes.set_axis_on()
    figure.text(0.5, 0.03, confusion.source, ha="center", color=INK, fontsize=9)
    figure.savefig(path, format="png")


def draw_rooms(path: Path, shown: list[tuple[Room, Arrangements]], title: str) -> None:
    """Rooms side by side, each with its first arrangement: robot, person, and the POIs that both see in green."""
    figure, panels = _figure(6.2 * len(shown), 6.2, len(shown), title)
    for axes, (room, drawn) in zip(panels, shown, strict=True):
        _draw_room(axes, room, drawn)
    caption = "green square: robot; green circle: person, with the way to the POI meant; green POIs: seen by both"
    figure.text(0.5, 0.03, f"{caption}; {NOTE}", ha="center", color=INK, fontsize=8)
    figure.savefig(path, format="png")


def _draw_room(axes: Axes, room: Room, drawn: Arrangements) -> None:
    ends = room.wall_ends
    low, high = ends.min(axis=(0, 1)) - 0.8, ends.max(axis=(0, 1)) + 0.8
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    for one, other in ends:
        axes.plot([one[0], other[0]], [one[1], other[1]], color=INK, linewidth=2, solid_capstyle="round", zorder=1)
    centre = (low + high) / 2
    for i, place in enumerate(room.poi_positions):
        colour = VISIBLE if drawn.visible[0, i] else GREY
        axes.plot(*place, "o", color=colour, markersize=9, markeredgecolor=PAPER, zorder=3)
        outward = 0.5 * np.sign(np.where(np.abs(place - centre) > 0.35 * (high - low), place - centre, 0.0))
        shift = outward if outward.any() else np.array([-0.1, 0.55])
        x, y = place + shift
        axes.text(x, y, f"P{i + 1}", ha="center", va="center", fontsize=9, color=INK)
    robot, person, meant = drawn.robot[0], drawn.person[0], room.poi_positions[drawn.meant[0]]
    axes.plot(*np.transpose([person, meant]), color=VISIBLE, linewidth=1.2, zorder=2)
    axes.add_patch(Rectangle((robot[0] - 0.25, robot[1] - 0.25), 0.5, 0.5, color=VISIBLE, zorder=3))
    axes.add_patch(Circle((person[0], person[1]), 0.25, color=VISIBLE, zorder=3))


def _three_and_two(simulation: Simulation) -> list[Arrangements]:
    """The first arrangements in room C with three and with two POIs visible, as in figure 8."""
    drawn = simulation.arrangements(ROOM_C, (2, 0), 400)
    numbers = drawn.visible.sum(axis=1)
    return [drawn.part(slice(first, first + 1)) for first in (int(np.argmax(numbers == 3)), int(np.argmax(numbers == 2)))]


def _figure(width: float, height: float, panels: int, title: str) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=12, weight="bold", color=INK)
    found = [figure.add_subplot(1, panels, i + 1) for i in range(panels)]
    for axes in found:
        axes.set_aspect("equal")
        axes.set_axis_off()
    figure.subplots_adjust(left=0.09 if panels == 1 else 0.02, right=0.98, top=0.92, bottom=0.1, wspace=0.03)
    return figure, found


def _toward(bearing_deg: float) -> tuple[float, float]:
    """On the unit circle, ahead being up and the person's left being left."""
    return -float(np.sin(np.radians(bearing_deg))), float(np.cos(np.radians(bearing_deg)))
