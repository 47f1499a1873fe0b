"""The label image: person << 5 | skin << 4 | part, 0 where nobody is. What of a person is seen, pixel for pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .scene import ArmSide

HEAD = 1
HAND: dict[ArmSide, int] = {"right": 3, "left": 4}
SKIN_BIT = 1 << 4
PART_BITS = SKIN_BIT - 1

Labels = NDArray[np.uint8]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Region:
    """Pixels of one thing: how many, the box around them (x, y, width, height), their mean; none where there are none."""

    pixels: int
    box: list[int] | None
    centroid: list[float] | None


def face_mask(labels: Labels, person: int) -> Mask:
    """Skin of the head (h, w)."""
    return _part(labels, person, HEAD) & ((labels & SKIN_BIT) > 0)


def hand_mask(labels: Labels, person: int, side: ArmSide) -> Mask:
    """One hand (h, w)."""
    return _part(labels, person, HAND[side])


def region_of(mask: Mask) -> Region:
    """Count, box and mean of the pixels of a mask."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return Region(0, None, None)
    left, top = int(columns.min()), int(rows.min())
    box = [left, top, int(columns.max()) - left + 1, int(rows.max()) - top + 1]
    return Region(len(rows), box, [round(float(columns.mean()), 2), round(float(rows.mean()), 2)])


def _part(labels: Labels, person: int, part: int) -> Mask:
    mask: Mask = (labels >> 5 == person) & ((labels & PART_BITS) == part)
    return mask
