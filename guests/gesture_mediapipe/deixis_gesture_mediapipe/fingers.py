"""What the fingers of a hand show, from its landmarks. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Shape = Literal["index", "fist", "other"]

CHAINS = {
    "thumb": (1, 2, 3, 4),
    "index": (5, 6, 7, 8),
    "middle": (9, 10, 11, 12),
    "ring": (13, 14, 15, 16),
    "little": (17, 18, 19, 20),
}
INDEX_KNUCKLE, INDEX_TIP = 5, 8
STRAIGHT, FOLDED = 0.9, 0.8
"""Way from knuckle to tip by the length of the finger: a finger that is straight, and one that is not."""
STRAIGHTER = 0.12
"""A pointing index finger is by so much straighter than the others where neither is clear: small hands are read softly."""


@dataclass(frozen=True)
class HandRead:
    """A hand: landmarks (21, 2) in pixels, and (21, 3) in metres about its middle, x right, y down, z away from the camera."""

    points: Floats
    metric: Floats


def straightness(metric: Floats, finger: str) -> float:
    """From knuckle to tip by the finger's own length: 1 where it is stretched."""
    joints = metric[list(CHAINS[finger])]
    length = float(np.linalg.norm(np.diff(joints, axis=0), axis=1).sum())
    return float(np.linalg.norm(joints[-1] - joints[0])) / length if length > 0 else 0.0


def shape_of(hand: HandRead) -> Shape:
    """The index finger alone, all fingers folded, or anything else: an open hand, two fingers."""
    index = straightness(hand.metric, "index")
    others = [straightness(hand.metric, finger) for finger in ("middle", "ring", "little")]
    stretched = sum(value >= STRAIGHT for value in others)
    if index >= FOLDED and stretched <= 1 and index - sorted(others)[1] >= STRAIGHTER:
        return "index"
    if index < STRAIGHT and not stretched:
        return "fist"
    return "other"


def pointing_deg(hand: HandRead) -> float | None:
    """Where the index finger points to, seen from above: degrees from the direction to the camera, positive toward image
    right; none where it points at the floor or the ceiling.
    """
    x, y, z = hand.metric[INDEX_TIP] - hand.metric[INDEX_KNUCKLE]
    floor = math.hypot(x, z)
    return math.degrees(math.atan2(x, -z)) if floor > abs(y) / 3 else None
