"""Heads of people who walk past in profile, where no frontal face is seen: the top of a moving, upright silhouette.

Somebody who comes into an empty room differs from it from head to foot, so the head is the top of the changed region; skin
in it tells a person from a door that opens.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]

SHRINK = 2  # of the coarse masks
LEAST_HEIGHT_PX = 45
LEAST_SLENDERNESS = 1.5  # height over width
SKIN = 60


class SilhouetteHead(NamedTuple):
    """Centre of a head and the width of its face, pixels."""

    x: float
    y: float
    width: float


def find_heads(changed: Mask, skin: Image, people: Mask) -> list[SilhouetteHead]:
    """Heads on top of changed regions (H, W), in its pixels, outside of `people` (255 where somebody is tracked already)."""
    size = (changed.shape[1] // SHRINK, changed.shape[0] // SHRINK)
    small = cv2.resize(cv2.bitwise_and(changed, cv2.bitwise_not(people)), size, interpolation=cv2.INTER_AREA)
    solid = cv2.morphologyEx(np.asarray(small > 100, np.uint8), cv2.MORPH_CLOSE, np.ones((5, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(solid, connectivity=8)
    heads = []
    for k in range(1, count):
        x, y, w, h, area = (int(v) for v in stats[k])
        if h * SHRINK < LEAST_HEIGHT_PX or h < LEAST_SLENDERNESS * w or area < 0.25 * w * h or x == 0 or x + w == size[0]:
            continue
        head = _top_of(np.asarray(labels[y : y + h, x : x + w] == k, np.uint8), x, y)
        if head is not None and _has_skin(head, skin):
            heads.append(head)
    return heads


def _top_of(mask: Mask, x0: int, y0: int) -> SilhouetteHead | None:
    """The head on top of one silhouette: rows from the top until the shoulders widen."""
    rows = mask.sum(axis=1)
    longest = max(3, len(rows) // 6)
    width = float(np.median(rows[: max(2, longest * 2 // 3)]))
    shoulders = float(np.median(rows[longest + 1 : 2 * longest + 2]))
    if width < 3 or shoulders < 1.15 * width:
        return None
    head = mask[: round(1.3 * width)]
    columns = np.nonzero(head)[1]
    # A head in profile is about 1.3 face widths deep.
    face = width * SHRINK / 1.25
    return SilhouetteHead((x0 + float(columns.mean()) + 0.5) * SHRINK, y0 * SHRINK + 0.68 * face, face)


def _has_skin(head: SilhouetteHead, skin: Image) -> bool:
    half = 0.6 * head.width
    top, left = max(0, int(head.y - half)), max(0, int(head.x - half))
    part = skin[top : int(head.y + half), left : int(head.x + half)]
    return part.size > 0 and float(np.count_nonzero(part > SKIN)) / part.size > 0.15
