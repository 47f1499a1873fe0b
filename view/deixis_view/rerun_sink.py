"""Logs drawings to Rerun: the thin shell around the core."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from .blueprint import blueprint
from .drawing import Arrows, Boxes, CurveStyle, Dots, Drawing, Layout, Lines, Note, Page, Picture, Primitive, Shot, Value

APPLICATION = "deixis"
FLUSH_S = 0.25
TRY_AGAIN_S = 1.0
"""A viewer that has let us wait in vain is not waited for again so soon."""
END_S = 5.0
BATCH_S, BATCH_BYTES = 1.0, 4 << 20


class SinkError(OSError):
    """What is drawn cannot be kept; the text names the file."""


class RerunSink:
    """A Rerun recording, to a file or to a viewer.

    live: `draw` returns soon even where the viewer takes nothing: then the shot is left out and counted in `left_out`, so that
    no more waits in the library than one shot. Else nothing is left out, and what is drawn goes out in batches, which load
    many times faster.
    """

    def __init__(self, *, name: str, live: bool) -> None:
        self.left_out = 0
        self._live = live
        batches = rr.ChunkBatcherConfig.DEFAULT() if live else rr.ChunkBatcherConfig(BATCH_S, BATCH_BYTES)
        self._stream = rr.RecordingStream(APPLICATION, batcher_config=batches)
        self._stream.send_recording_name(name)
        self._stuck_until_s = 0.0

    def to_file(self, path: Path) -> RerunSink:
        """Write a file. Raises SinkError where that cannot be made."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.open("wb").close()
        except OSError as error:
            raise SinkError(f"'{path}': {error.strerror}") from None
        self._stream.save(path)
        return self

    def to_viewer(self, url: str) -> RerunSink:
        """Send to a viewer at a gRPC `url`."""
        self._stream.connect_grpc(url)
        return self

    def lay_out(self, layout: Layout) -> None:
        """Lay out the views."""
        self._stream.send_blueprint(blueprint(layout))

    def draw(self, shot: Shot) -> bool:
        """Log a shot; whether it was, or was left out for a viewer that does not keep up."""
        if self._live and not self._takes_more():
            self.left_out += 1
            return False
        self._stream.set_time("time", timestamp=np.datetime64(shot.stamp_ns, "ns"))
        if shot.seq is None:
            self._stream.disable_timeline("seq")
        else:
            self._stream.set_time("seq", sequence=shot.seq)
        for drawing in shot.drawings:
            self._log(drawing)
        return True

    def close(self) -> bool:
        """Send what is left, for a few seconds at most; whether all went."""
        sent = self._flushed(END_S)
        if sent:
            self._stream.disconnect()
        return sent

    def _takes_more(self) -> bool:
        """Whether the viewer has taken all that was sent: the library itself keeps hundreds of megabytes before it waits."""
        if time.monotonic() < self._stuck_until_s:
            return False
        taken = self._flushed(FLUSH_S)
        self._stuck_until_s = 0.0 if taken else time.monotonic() + TRY_AGAIN_S
        return taken

    def _flushed(self, timeout_s: float) -> bool:
        try:
            self._stream.flush(timeout_sec=timeout_s)
        except RuntimeError:  # "Flush timed out"
            return False
        return True

    def _log(self, drawing: Drawing) -> None:
        if isinstance(drawing.what, CurveStyle):
            style = rr.SeriesLines(names=drawing.what.name, colors=drawing.what.colour, widths=2.0)
            self._stream.log(drawing.path, style, static=True)
        else:
            self._stream.log(drawing.path, ARCHETYPES[type(drawing.what)](drawing.what))


def _lines(lines: Lines) -> Any:
    radii = rr.Radius.ui_points([width / 2 for width in lines.widths])
    return rr.LineStrips2D(lines.strips, radii=radii, colors=lines.colours, labels=lines.labels or None, show_labels=True)


def _arrows(arrows: Arrows) -> Any:
    return rr.Arrows2D(origins=arrows.origins, vectors=arrows.vectors, colors=arrows.colours, radii=rr.Radius.ui_points(2.5))


def _boxes(boxes: Boxes) -> Any:
    return rr.Boxes2D(array=boxes.xywh, array_format=rr.Box2DFormat.XYWH, labels=boxes.labels, colors=boxes.colours)


def _dots(dots: Dots) -> Any:
    return rr.Points2D(dots.points, radii=dots.radii, labels=dots.labels or None, colors=dots.colours, show_labels=True)


def _note(note: Note) -> Any:
    return rr.TextLog(note.text, level=rr.TextLogLevel.WARN if note.fault else rr.TextLogLevel.INFO)


ARCHETYPES: dict[type[Primitive], Callable[[Any], Any]] = {
    Picture: lambda picture: rr.EncodedImage(contents=picture.jpeg, media_type="image/jpeg"),
    Value: lambda value: rr.Scalars(value.value),
    Page: lambda page: rr.TextDocument(page.markdown, media_type=rr.MediaType.MARKDOWN),
    Lines: _lines,
    Arrows: _arrows,
    Boxes: _boxes,
    Dots: _dots,
    Note: _note,
}
