"""What Foxglove shows by itself, of what a recording holds: picture and drawings over it, the map from above, curves and a log.

Messages of Foxglove's own schemas, in channels below `shown/` beside those of the contract.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from deixis_cli.raw_message import RawMessage
from deixis_cli.shown import Show, Shown

# Foxglove's own schemas (MIT), generated for Python, and how MCAP names them: four megabytes, where its SDK takes 54.
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from mcap_protobuf.schema import build_file_descriptor_set

from . import floor, overlay
from .colours import Colour
from .drawer import Painter
from .drawing import Arrows, Boxes, Dots, Drawing, Layout, Lines, Note, Page, Picture, Point2, Primitive, Shot, Value
from .options import DrawOptions, known_place, scene_of

FRAME = "map"
LINE_PX, LABEL_PX = 2.0, 14.0
ARROW_HEAD = 0.25
"""Length of the strokes of an arrow's head, of the arrow's."""
PROTOBUF, JSON_SCHEMA = "protobuf", "jsonschema"
VALUE = {"type": "object", "properties": {"value": {"type": "number"}}}
TEXT = {"type": "object", "properties": {"markdown": {"type": "string"}}}


def show_in_foxglove(site: Path | None) -> Show:
    """What makes Foxglove's messages of each message in turn. Raises CommandError for a bad site file."""
    sink = FoxgloveSink()
    painter = Painter(scene_of(known_place(site), DrawOptions(), live=False), sink)

    def of(message: RawMessage) -> list[Shown]:
        painter.take(message)
        return sink.take()

    return of


class FoxgloveSink:
    """Makes messages of shots, and keeps them until they are taken."""

    def __init__(self) -> None:
        self._made: list[Shown] = []
        self._over: dict[str, Primitive] = {}
        self._pages: dict[str, str] = {}
        self._schemas: dict[str, bytes] = {}

    def lay_out(self, layout: Layout) -> None:
        """Foxglove's layouts are its users'."""

    def draw(self, shot: Shot) -> bool:
        """Make messages of a shot."""
        above = SceneUpdate()
        for drawing in shot.drawings:
            self._draw(drawing, shot.stamp_ns, above)
        if any(_is_over(drawing) for drawing in shot.drawings):
            # An annotation takes the place of the one before it, all of it: what was not drawn anew is said again.
            self._say("annotations", drawn_over(self._over, shot.stamp_ns))
        if above.entities:
            self._say("map", above)
        return True

    def take(self) -> list[Shown]:
        """What was made since the last call."""
        made, self._made = self._made, []
        return made

    def _draw(self, drawing: Drawing, stamp_ns: int, above: SceneUpdate) -> None:
        path, what = drawing
        if isinstance(what, Picture):
            self._say("picture", CompressedImage(timestamp=_time(stamp_ns), frame_id="camera", data=what.jpeg, format="jpeg"))
        elif _is_over(drawing):
            self._over[path] = what
        elif path.startswith(f"{floor.ROOT}/"):
            above.entities.append(entity(path, what, stamp_ns))
        elif isinstance(what, Value):
            self._made.append(
                Shown(f"shown/{path}", "deixis.Value", JSON_SCHEMA, _json(VALUE), "json", _json({"value": what.value}))
            )
        elif isinstance(what, Page) and self._pages.get(path) != what.markdown:
            self._pages[path] = what.markdown
            self._made.append(
                Shown(f"shown/{path}", "deixis.Text", JSON_SCHEMA, _json(TEXT), "json", _json({"markdown": what.markdown}))
            )
        elif isinstance(what, Note):
            level = Log.WARNING if what.fault else Log.INFO
            self._say("log", Log(timestamp=_time(stamp_ns), level=level, message=what.text, name="deixis"))

    def _say(self, topic: str, message: Message) -> None:
        name = message.DESCRIPTOR.full_name
        if name not in self._schemas:
            self._schemas[name] = build_file_descriptor_set(type(message)).SerializeToString()
        self._made.append(Shown(f"shown/{topic}", name, PROTOBUF, self._schemas[name], PROTOBUF, message.SerializeToString()))


def drawn_over(over: dict[str, Primitive], stamp_ns: int) -> ImageAnnotations:
    """What is drawn over the picture, in its pixels."""
    found = ImageAnnotations()
    for what in over.values():
        for line in _outlines(what):
            points = found.points.add(timestamp=_time(stamp_ns), type=line.kind, thickness=line.width)
            points.outline_color.CopyFrom(_colour(line.colour))
            points.fill_color.CopyFrom(_colour(line.colour, 0.0))
            for x, y in line.points:
                points.points.add(
                    x=x + 0.5, y=y + 0.5
                )  # Foxglove counts from the corner of the first pixel, we from its middle
        for (x, y), text, colour in _labels(what):
            label = found.texts.add(timestamp=_time(stamp_ns), text=text, font_size=LABEL_PX)
            label.position.x, label.position.y = x, y
            label.text_color.CopyFrom(_colour(colour))
            label.background_color.CopyFrom(Color(r=0.0, g=0.0, b=0.0, a=0.5))
    return found


def entity(path: str, what: Primitive, stamp_ns: int) -> SceneEntity:
    """What is drawn of the place at a path, in metres of the map; it takes the place of what was there."""
    found = SceneEntity(timestamp=_time(stamp_ns), frame_id=FRAME, id=path)
    for line in _outlines(what) if isinstance(what, Lines) else ():
        strip = found.lines.add(type=LinePrimitive.LINE_STRIP, thickness=line.width, scale_invariant=True)
        strip.pose.orientation.w = 1.0
        strip.color.CopyFrom(_colour(line.colour))
        for point in line.points:
            x, y = _of_map(point)
            strip.points.add(x=x, y=y)
    for point, radius, colour in zip(what.points, what.radii, what.colours, strict=True) if isinstance(what, Dots) else ():
        ball = found.spheres.add(color=_colour(colour))
        ball.pose.position.x, ball.pose.position.y = _of_map(point)
        ball.pose.orientation.w = 1.0
        ball.size.x = ball.size.y = ball.size.z = 2 * radius
    for point, text, colour in _labels(what):
        label = found.texts.add(text=text, billboard=True, scale_invariant=True, font_size=LABEL_PX, color=_colour(colour))
        label.pose.position.x, label.pose.position.y = _of_map(point)
        label.pose.position.z = 0.3  # above the thing
        label.pose.orientation.w = 1.0
    return found


class _Line:
    """A strip, a closed one, or single points of a width."""

    def __init__(self, points: list[Point2], colour: Colour, kind: int, width: float = LINE_PX) -> None:
        self.points, self.colour, self.kind, self.width = points, colour, kind, width


STRIP: int = PointsAnnotation.LINE_STRIP
LOOP: int = PointsAnnotation.LINE_LOOP
POINTS: int = PointsAnnotation.POINTS


def _outlines(what: Primitive) -> Iterator[_Line]:
    if isinstance(what, Lines):
        for strip, width, colour in zip(what.strips, what.widths, what.colours, strict=True):
            yield _Line(strip, colour, STRIP, width)
    elif isinstance(what, Boxes):
        for (x, y, width, height), colour in zip(what.xywh, what.colours, strict=True):
            yield _Line([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], colour, LOOP)
    elif isinstance(what, Dots):
        for point, radius, colour in zip(what.points, what.radii, what.colours, strict=True):
            yield _Line([point], colour, POINTS, 2 * radius)
    elif isinstance(what, Arrows):
        for origin, vector, colour in zip(what.origins, what.vectors, what.colours, strict=True):
            yield _Line(_arrow(origin, vector), colour, STRIP, 2 * LINE_PX)


def _arrow(origin: Point2, vector: Point2) -> list[Point2]:
    (x, y), (dx, dy) = origin, vector
    tip = (x + dx, y + dy)
    back = [(tip[0] - ARROW_HEAD * (dx - side * dy), tip[1] - ARROW_HEAD * (dy + side * dx)) for side in (1, -1)]
    return [origin, tip, back[0], tip, back[1]]


def _labels(what: Primitive) -> Iterator[tuple[Point2, str, Colour]]:
    """Where, what and in which colour something is written."""
    if isinstance(what, Boxes):
        places: list[Point2] = [(x, y) for x, y, _, _ in what.xywh]
    elif isinstance(what, Dots):
        places = what.points
    elif isinstance(what, Lines):
        places = [strip[-1] for strip in what.strips]
    else:
        return
    if what.labels:
        yield from ((at, text, colour) for at, text, colour in zip(places, what.labels, what.colours, strict=True) if text)


def _is_over(drawing: Drawing) -> bool:
    return drawing.path.startswith(f"{overlay.ROOT}/") and isinstance(drawing.what, Lines | Boxes | Dots | Arrows)


def _of_map(point: Point2) -> Point2:
    """A point of the view from above in the map, metres: `floor.shown` is its own inverse."""
    return floor.shown(*point)


def _colour(colour: Colour, opacity: float = 1.0) -> Color:
    red, green, blue = (part / 255 for part in colour)
    return Color(r=red, g=green, b=blue, a=opacity)


def _time(stamp_ns: int) -> Timestamp:
    return Timestamp(seconds=stamp_ns // 1_000_000_000, nanos=stamp_ns % 1_000_000_000)


def _json(content: object) -> bytes:
    return json.dumps(content).encode()
