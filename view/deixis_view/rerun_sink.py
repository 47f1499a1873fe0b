"""Logs drawings to Rerun: the thin shell around the core."""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from .blueprint import blueprint
from .drawing import Arrows, Boxes, CurveStyle, Dots, Drawing, Layout, Lines, Note, Page, Picture, Primitive, Shot, Value
from .installed import SinkError

APPLICATION = "deixis"
FLUSH_S = 0.25
TRY_AGAIN_S = 1.0
"""A viewer that has let us wait in vain is not waited for again so soon."""
END_S = 5.0
BATCH_S, BATCH_BYTES = 1.0, 4 << 20


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
        self._out: tuple[Path, Path] | None = None

    def to_file(self, path: Path) -> RerunSink:
        """Write a file, which has its name when all is in it: until `close` a file that is there stays as it was.

        Raises SinkError where that cannot be made.
        """
        part = path.with_name(f"{path.stem}.part{path.suffix}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_dir():
                raise SinkError(f"'{path}' is a folder")
            part.open("wb").close()
        except OSError as error:
            raise error if isinstance(error, SinkError) else SinkError(f"'{path}': {error.strerror}") from None
        self._out = part, path
        # Also where nobody comes to discard it, as when a run does not start.
        self._discard_part = weakref.finalize(self, part.unlink, missing_ok=True)
        self._stream.save(part)
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
        """Send what is left, for a few seconds at most; whether all went. A file gets its name then.

        Raises SinkError where it cannot.
        """
        sent = self._flushed(END_S)
        if sent:
            self._stream.disconnect()
            self._name_file()
        return sent

    def discard(self) -> None:
        """Leave no file that was not closed."""
        if self._out is not None:
            self._discard_part()

    def _name_file(self) -> None:
        if self._out is None:
            return
        part, path = self._out
        try:
            part.replace(path)
        except OSError as error:
            raise SinkError(f"'{path}': {error.strerror}") from None
        self._discard_part.detach()

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
