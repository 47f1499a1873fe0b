"""Where a person's hands can be: the part of the picture in which they are looked for."""

from __future__ import annotations

from .seen import Point, Region

REACH = 5.0
"""Of an arm from the face, face widths; with what a hand near to the camera looks farther away."""
MIDDLE_BELOW_FACE = 1.2
MOVED, GROWN = 1.0, 1.25
"""The region stays where it is until the face has gone so far, face widths, or grown so much: within it hands are followed."""


class HandRegion:
    """The region of one person."""

    def __init__(self) -> None:
        self._face: tuple[Point, float] | None = None
        self._region: Region = (0, 0, 0, 0)

    def about(self, centre: Point, width_px: float, size: tuple[int, int]) -> Region:
        """The region about a face of that width in a picture of that size (width, height)."""
        if self._face is None or self._has_moved(centre, width_px):
            self._face = centre, width_px
            self._region = region_about(centre, width_px, size)
        return self._region

    def _has_moved(self, centre: Point, width_px: float) -> bool:
        assert self._face is not None
        (x, y), width = self._face
        far = max(abs(centre[0] - x), abs(centre[1] - y)) > MOVED * width
        return far or not 1 / GROWN < width_px / width < GROWN


def region_about(centre: Point, width_px: float, size: tuple[int, int]) -> Region:
    """A square about what arms reach, cut to the picture; the whole picture where nothing is left of it."""
    half = REACH * width_px
    x, y = centre[0], centre[1] + MIDDLE_BELOW_FACE * width_px
    left, right = (min(max(round(edge), 0), size[0]) for edge in (x - half, x + half))
    top, bottom = (min(max(round(edge), 0), size[1]) for edge in (y - half, y + half))
    if right - left < width_px or bottom - top < width_px:
        return 0, 0, size[0], size[1]
    return left, top, right - left, bottom - top
