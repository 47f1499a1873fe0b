"""Which points of the map a person can see: walls as segments in the plane (the paper's rooms, section 7.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence

Point2 = tuple[float, float]
Wall = tuple[Point2, Point2]


def sees(eye: Point2, target: Point2, walls: Sequence[Wall], clearance_m: float = 0.15) -> bool:
    """Whether the line of sight from `eye` to `target` crosses no wall; map frame, metres.

    POIs hang on walls, on either side of the line that stands for one: the last `clearance_m` of the way do not count.
    """
    dx, dy = target[0] - eye[0], target[1] - eye[1]
    distance = math.hypot(dx, dy)
    if distance <= clearance_m:
        return True
    share = 1 - clearance_m / distance
    end = (eye[0] + dx * share, eye[1] + dy * share)
    return not any(_cross(eye, end, a, b) for a, b in walls)


def _cross(p: Point2, q: Point2, a: Point2, b: Point2) -> bool:
    """Whether the segments p-q and a-b share a point."""
    d1, d2 = _side(a, b, p), _side(a, b, q)
    d3, d4 = _side(p, q, a), _side(p, q, b)
    if d1 * d2 < 0 and d3 * d4 < 0:
        return True
    return (
        (d1 == 0 and _within(a, b, p))
        or (d2 == 0 and _within(a, b, q))
        or (d3 == 0 and _within(p, q, a))
        or (d4 == 0 and _within(p, q, b))
    )


def _side(a: Point2, b: Point2, p: Point2) -> float:
    """Twice the signed area of a, b, p: positive where p is left of a -> b."""
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


def _within(a: Point2, b: Point2, p: Point2) -> bool:
    """Whether p, known to be on the line a-b, is on the segment."""
    return min(a[0], b[0]) <= p[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= p[1] <= max(a[1], b[1])
