"""Where people stand, which way they face, and where they come from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .bearings import azimuth_of, heading_to, place_at
from .dice import Dice, Range
from .draw_actions import Target
from .draw_plan import Plan
from .geometry import wrap_deg
from .scene import Place, ScenePoi

CAMERA: Place = (0.0, 0.0)


@dataclass(frozen=True)
class Stands:
    """Where people stand: aside, others_aside: shares of the lens's field of view to either side; distances from, to.

    mostly_near: evenly in the distance's logarithm. front_deg: of who faces the robot, standard deviation and limit; turned:
    share of those who are turned well aside. apart_m: between people, across the line of sight. clear_m: of anybody else
    from the line between camera and a pointing hand; where it is 0, hands just do not end within others.
    """

    aside: float = 0.36
    distance_m: Range = (1.1, 3.5)
    mostly_near: bool = False
    front_deg: Range = (16, 45)
    turned: float = 0.2
    others_aside: float = 0.44
    others_distance_m: Range = (1.2, 3.8)
    apart_m: float = 0.5
    clear_m: float = 0.0
    carries: float = 0.3


ANY_STANDS = Stands()


@dataclass(frozen=True)
class Standing:
    """Where a person stands while it acts, and comes from where it walks. Headings in the map, degrees."""

    place: Place
    heading_deg: float
    start: Place

    @property
    def walks(self) -> bool:
        """Whether it comes from elsewhere."""
        return self.start != self.place

    @property
    def front_deg(self) -> float:
        """Azimuth of the body's front."""
        return wrap_deg(self.heading_deg - heading_to(self.place, CAMERA))

    def targets(self, pois: Sequence[ScenePoi]) -> list[Target]:
        """All POIs as this person has them."""
        front = self.front_deg
        return [
            Target(poi.poi_id, wrap_deg(azimuth_of(self.place, CAMERA, poi.position_m[:2]) - front))
            for poi in pois
            if math.dist(self.place, poi.position_m[:2]) > 0.5
        ]


def draw_front(dice: Dice, stands: Stands = ANY_STANDS) -> float:
    """Azimuth of a body's front: mostly toward the robot, sometimes well aside."""
    sigma, limit = stands.front_deg
    near, far = dice.near(0, sigma, -limit, limit, 1), dice.between(-65, 65, 1)
    return far if dice.chance(stands.turned) else near


def draw_standing(dice: Dice, plan: Plan, fov_deg: float, stands: Stands = ANY_STANDS) -> Standing:
    """Place and heading of the first person."""
    bearing = dice.between(-stands.aside, stands.aside) * fov_deg
    between = dice.between_log if stands.mostly_near else dice.between
    place = place_at(CAMERA, bearing, between(*stands.distance_m))
    heading = heading_to(place, CAMERA) + draw_front(dice, stands)
    if plan.plot == "through":
        return _crossing(dice, fov_deg, math.dist(place, CAMERA))
    if plan.plot in ("in_point", "in_gestures"):
        return Standing(_rounded(place), wrap_deg(heading), _rounded(_entrance(dice, place, bearing, fov_deg)))
    return Standing(_rounded(place), round(wrap_deg(heading), 1), _rounded(place))


def _entrance(dice: Dice, place: Place, bearing_deg: float, fov_deg: float) -> Place:
    """Where who walks in comes from: from beside the picture, or from farther back in it."""
    outside, side = dice.chance(0.6), dice.one((-1, 1))
    away = math.dist(place, CAMERA)
    far = away + dice.between(0.7, 1.4)
    edge = side * (fov_deg / 2 + dice.between(6, 12))
    beside = place_at(CAMERA, edge, away + dice.between(0, 0.4))
    behind = place_at(CAMERA, bearing_deg * 0.7, far)
    return beside if outside else behind


def _crossing(dice: Dice, fov_deg: float, away_m: float) -> Standing:
    """Straight through the picture, from one side to the other, parallel to it or nearly."""
    side, edge = dice.one((-1, 1)), fov_deg / 2 + 10
    away = max(away_m, 1.6)
    start = place_at(CAMERA, side * edge, away / math.cos(math.radians(edge)) * dice.between(0.9, 1.05))
    end = place_at(CAMERA, -side * edge, away / math.cos(math.radians(edge)) * dice.between(0.9, 1.05))
    return Standing(_rounded(end), round(wrap_deg(heading_to(start, end)), 1), _rounded(start))


def _rounded(place: Place) -> Place:
    return round(place[0], 3), round(place[1], 3)
