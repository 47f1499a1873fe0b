"""Directions on the floor of the map, degrees counter-clockwise from its x axis; metres."""

from __future__ import annotations

import math

from .geometry import wrap_deg
from .scene import Place


def heading_to(start: Place, end: Place) -> float:
    """Heading of the way from one place to another."""
    return math.degrees(math.atan2(end[1] - start[1], end[0] - start[0]))


def place_at(start: Place, heading_deg: float, distance_m: float) -> Place:
    """Place that lies so far off in that direction."""
    heading = math.radians(heading_deg)
    return start[0] + distance_m * math.cos(heading), start[1] + distance_m * math.sin(heading)


def azimuth_of(person: Place, camera: Place, target: Place) -> float:
    """Azimuth of a target at a person, from the direction to the camera, positive toward the person's own left."""
    return wrap_deg(heading_to(person, target) - heading_to(person, camera))


def off_line_m(place: Place, start: Place, end: Place) -> float:
    """Distance of a place from the straight way between two others."""
    way = (end[0] - start[0], end[1] - start[1])
    squared = way[0] ** 2 + way[1] ** 2
    along = ((place[0] - start[0]) * way[0] + (place[1] - start[1]) * way[1]) / squared if squared else 0.0
    share = min(max(along, 0.0), 1.0)
    return math.dist(place, (start[0] + share * way[0], start[1] + share * way[1]))
