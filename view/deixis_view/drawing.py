"""What is to be drawn, as plain values: the core says it, the sink logs it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from .colours import Colour

Point2 = tuple[float, float]


@dataclass(frozen=True)
class Picture:
    """A JPEG file."""

    jpeg: bytes


@dataclass(frozen=True)
class Boxes:
    """Rectangles as (x, y, width, height)."""

    xywh: list[tuple[float, float, float, float]] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    colours: list[Colour] = field(default_factory=list)


@dataclass(frozen=True)
class Dots:
    """Discs of a radius in units of their view."""

    points: list[Point2] = field(default_factory=list)
    radii: list[float] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    colours: list[Colour] = field(default_factory=list)


@dataclass(frozen=True)
class Lines:
    """Strips of points; widths are in pixels of the screen."""

    strips: list[list[Point2]] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    colours: list[Colour] = field(default_factory=list)


@dataclass(frozen=True)
class Arrows:
    """From `origins` along `vectors`."""

    origins: list[Point2] = field(default_factory=list)
    vectors: list[Point2] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    colours: list[Colour] = field(default_factory=list)


@dataclass(frozen=True)
class Value:
    """One point of a curve over time."""

    value: float


@dataclass(frozen=True)
class CurveStyle:
    """How the curve at this path is called and coloured; said once."""

    name: str
    colour: Colour


@dataclass(frozen=True)
class Page:
    """A text in Markdown."""

    markdown: str


@dataclass(frozen=True)
class Note:
    """A line of the log; `fault` where something is wrong."""

    text: str
    fault: bool = False


Primitive = Picture | Boxes | Dots | Lines | Arrows | Value | CurveStyle | Page | Note


class Drawing(NamedTuple):
    """A primitive at its path. What is drawn at a path takes the place of what was there; none of it clears it."""

    path: str
    what: Primitive


@dataclass(frozen=True)
class Shot:
    """All that is to be drawn of one time. seq: of the frame; none where it is of no frame."""

    stamp_ns: int
    seq: int | None
    drawings: list[Drawing]


@dataclass(frozen=True)
class Layout:
    """What the views should show.

    bounds: left, top, right and bottom of the map's view. picture: width and height of the pictures, none where unknown.
    live: the last seconds, not all.
    """

    bounds: tuple[float, float, float, float]
    picture: tuple[float, float] | None
    live: bool
