"""Plain geometry of upright boxes in a picture."""

from __future__ import annotations

from typing import NamedTuple


class Box(NamedTuple):
    """Left, top, width, height in pixels."""

    x: float
    y: float
    w: float
    h: float

    @property
    def centre(self) -> tuple[float, float]:
        """Centre (x, y)."""
        return self.x + self.w / 2, self.y + self.h / 2

    def scaled(self, factor: float) -> Box:
        """The same box in a picture scaled by `factor`."""
        return Box(self.x * factor, self.y * factor, self.w * factor, self.h * factor)

    def window(self, height: int, width: int) -> tuple[slice, slice]:
        """Rows and columns of the part inside a picture; empty slices when it lies outside."""
        x0, y0 = (min(max(0, int(v)), limit) for v, limit in ((self.x, width), (self.y, height)))
        x1, y1 = (min(max(0, round(v)), limit) for v, limit in ((self.x + self.w, width), (self.y + self.h, height)))
        return slice(y0, max(y0, y1)), slice(x0, max(x0, x1))


def around(x: float, y: float, left: float, top: float, right: float, bottom: float) -> Box:
    """Box that reaches so far from a point in each direction."""
    return Box(x - left, y - top, left + right, top + bottom)
