"""The words of table 1: gestures that a pointing hand is recognised as, and regions that are pointed to."""

from __future__ import annotations

from typing import Literal, get_args

PointingGesture = Literal["point_left", "invisible", "point_right"]
Region = Literal["left", "center", "right"]

GESTURES: tuple[PointingGesture, ...] = get_args(PointingGesture)
REGIONS: tuple[Region, ...] = get_args(Region)


def region_of(bearing_deg: float, range_deg: tuple[float, float]) -> Region:
    """The region of section 6.1 that a POI is in: within `range_deg` its pointing hand is recognised, as left or right."""
    if range_deg[0] <= abs(bearing_deg) <= range_deg[1]:
        return "left" if bearing_deg > 0 else "right"
    return "center"
