"""Whether what stands in a place sways: people do, by a pixel or so within a second; vases, busts and pictures never.

Two pictures of the place are laid over one another by least squares: a shift, a gain and an offset, for light changes. Noise
moves the shift of a head by some hundredths of a pixel; phase correlation took it for a sway. A camera that trembles moves
the room beside the head by as much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.frame import Box, Image, around

Array = NDArray[Any]

CELLS, BLUR_CELLS = 40, 1.2
HALF = 0.9  # head widths: what is compared around the middle of a head
APART_S = 0.1  # between the pictures, at least
MOST_PX = 4.0  # of a sway, pixels of the working picture; more is somebody else who passes
BESIDE, LIKE_THE_HEAD = 2.4, 0.5  # head widths to places beside it; share of the sway by which these may differ from it
ROOM_EXPLAINED = 0.3
LEAST_LEVELS = 4.0  # deviation of grey levels: an even patch has no place


class Sway(NamedTuple):
    """What counts as one: pixels of the working picture, and the share of what changed that they explain, beside the light."""

    least_px: float
    least_explained: float


# Chosen by `.venv/bin/python fitting/choose_sway.py` (seeds 1000:1028): SLIGHT are .69 of heads' looks and .02 of those at
# exhibits away from people, CLEAR .37 and none. Somebody far away who stands sways by .1 to .2 pixels; so did a violet bust, by
# the codec.
SLIGHT, CLEAR = Sway(0.1, 0.2), Sway(0.35, 0.3)


@dataclass(frozen=True)
class Patch:
    """A place as it was seen: `box` of the picture, as CELLS x CELLS grey levels."""

    box: Box
    cells: Array

    @classmethod
    def of(cls, picture: Image, box: Box) -> Patch | None:
        """None where the box is not whole in the picture (H, W, 3), or shows something even."""
        rows, columns = box.window(*picture.shape[:2])
        part = picture[rows, columns]
        if min(part.shape[:2]) < 0.95 * box.w or min(part.shape[:2]) < 4:
            return None
        grey = cv2.cvtColor(part, cv2.COLOR_BGR2GRAY)
        cells = cv2.resize(grey, (CELLS, CELLS), interpolation=cv2.INTER_AREA).astype(np.float32)
        cells = np.asarray(cv2.GaussianBlur(cells, (0, 0), BLUR_CELLS), np.float32)
        return cls(box, cells) if float(cells.std()) >= LEAST_LEVELS else None

    def moved(self, picture: Image, least_explained: float) -> Array | None:
        """How far it has moved (x, y) since, pixels; none where that explains less of what changed, or cannot be told."""
        now = Patch.of(picture, self.box)
        if now is None:
            return None
        shift_cells, explained = _shift(self.cells, now.cells)
        return shift_cells * self.box.w / CELLS if explained >= least_explained else None


@dataclass(frozen=True)
class Glimpse:
    """The place of a head, and those beside it, as they were seen at a time."""

    head: Patch
    beside: tuple[Patch, ...]
    seen_ns: int

    @classmethod
    def of(cls, picture: Image, x: float, y: float, width: float, now_ns: int) -> Glimpse | None:
        """The surroundings of a head at (x, y) of the picture (H, W, 3); none where they are not whole in it, or even."""
        half = HALF * width
        head, *beside = (
            Patch.of(picture, around(x + aside * width, y, half, half, half, half)) for aside in (0.0, -BESIDE, BESIDE)
        )
        return None if head is None else cls(head, tuple(patch for patch in beside if patch is not None), now_ns)

    def sways(self, picture: Image, now_ns: int, sway: Sway) -> bool:
        """Whether the place has moved since by so much and by no more than people do who stand, and not with the room."""
        if now_ns - self.seen_ns < APART_S * 1e9:
            return False
        head = self.head.moved(picture, sway.least_explained)
        if head is None or not sway.least_px <= math.hypot(*head) <= MOST_PX:
            return False
        room = (patch.moved(picture, ROOM_EXPLAINED) for patch in self.beside)
        return not any(moved is not None and math.dist(moved, head) < LIKE_THE_HEAD * math.hypot(*head) for moved in room)


def _shift(before: Array, now: Array) -> tuple[Array, float]:
    """How far a picture (h, w) has moved (x, y), pixels, and the share of the change that explains beside gain and offset."""
    down, right = np.gradient(before)
    light = np.stack([before.ravel(), np.ones(before.size, np.float32)], axis=1)
    unexplained = now.ravel() - light @ np.linalg.lstsq(light, now.ravel(), rcond=None)[0]
    slopes = np.stack([right.ravel(), down.ravel()], axis=1)
    slopes = slopes - light @ np.linalg.lstsq(light, slopes, rcond=None)[0]
    moved = np.linalg.lstsq(slopes, -unexplained, rcond=None)[0]
    left = unexplained + slopes @ moved
    whole = float(unexplained @ unexplained)
    return moved, 1 - float(left @ left) / whole if whole > 0 else 0.0
