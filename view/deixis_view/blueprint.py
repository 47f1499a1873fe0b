"""How the views are laid out: picture and map, below them curves over time, and at their side what is to be said in words."""

from __future__ import annotations

import rerun.blueprint as rrb

from . import curves, floor, overlay, pages, scene
from .drawing import Layout

WINDOW_S = 20.0
PICTURE_MARGIN = 0.01


def blueprint(layout: Layout) -> rrb.Blueprint:
    """The views for a layout."""
    left, top, right, bottom = layout.bounds
    whole = rrb.VisualBounds2D(x_range=[left, right], y_range=[top, bottom])
    ranges = _last_seconds() if layout.live else None
    share = rrb.ScalarAxis(range=(-0.02, 1.02), zoom_lock=True)
    corner = rrb.PlotLegend(corner=rrb.Corner2D.LeftTop)
    seen = rrb.Horizontal(
        rrb.Spatial2DView(origin=overlay.ROOT, name="What the stages see", visual_bounds=_picture(layout)),
        rrb.Spatial2DView(origin=floor.ROOT, name="From above", visual_bounds=whole),
        column_shares=[5, 4],
    )
    over_time = rrb.Horizontal(
        rrb.TimeSeriesView(
            origin=curves.BELIEF, name="How probable each is meant", axis_y=share, time_ranges=ranges, plot_legend=corner
        ),
        rrb.TimeSeriesView(origin=curves.CONFLICT, name="Conflict", axis_y=share, time_ranges=ranges, plot_legend=corner),
        rrb.TimeSeriesView(origin=curves.LATENCY, name="Capture to answer, ms", time_ranges=ranges, plot_legend=corner),
        column_shares=[5, 4, 4],
    )
    words = rrb.Vertical(
        rrb.TextDocumentView(origin=pages.REASON, name="The answer, and why"),
        rrb.TextDocumentView(origin=pages.HEALTH, name="Stages"),
        rrb.TextLogView(origin=scene.LOG, name="Answers", columns=_log_columns()),
        row_shares=[10, 6, 3],
    )
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(seen, over_time, row_shares=[5, 3]), words, column_shares=[3, 1]),
        rrb.TimePanel(timeline="time", state="collapsed"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
    )


def _picture(layout: Layout) -> rrb.VisualBounds2D | None:
    if layout.picture is None:
        return None
    width, height = layout.picture
    margin = PICTURE_MARGIN * width
    return rrb.VisualBounds2D(x_range=[-margin, width + margin], y_range=[-margin, height + margin])


def _last_seconds() -> list[rrb.VisibleTimeRange]:
    start = rrb.TimeRangeBoundary.cursor_relative(seconds=-WINDOW_S)
    return [rrb.VisibleTimeRange("time", start=start, end=rrb.TimeRangeBoundary.cursor_relative())]


def _log_columns() -> rrb.TextLogColumns:
    return rrb.TextLogColumns(timeline_columns=[], text_log_columns=["body"])
