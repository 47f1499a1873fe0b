"""The frame of discernment X (eq. 10): the POIs that a person can see, each with its bearing.

Walls are segments in the plane (the paper's rooms, section 7.2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from deixis_schemas.messages import Poi

from .localisation import PersonPlace, bearing_with_sigma_deg

Point2 = tuple[float, float]
Wall = tuple[Point2, Point2]


@dataclass(frozen=True)
class Candidate:
    """A POI that the person may mean. The bearing is at the person, positive toward the person's own left; degrees."""

    poi: Poi
    bearing_deg: float
    bearing_sigma_deg: float


def frame_of_discernment(place: PersonPlace, pois: Sequence[Poi], walls: Sequence[Wall], clearance_m: float) -> list[Candidate]:
    """Those of the POIs that are in sight of a person, in their order."""
    eye = (place.position_m[0], place.position_m[1])
    return [
        Candidate(poi, *bearing_with_sigma_deg(place, poi.position_m, poi.extent_m))
        for poi in pois
        if sees(eye, (poi.position_m[0], poi.position_m[1]), walls, clearance_m)
    ]


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
