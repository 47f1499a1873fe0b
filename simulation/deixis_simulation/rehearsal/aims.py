"""What a POI is to somebody at a place: its bearing, what hides it, whether the pointing hand is seen, what lies near it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

from deixis_fusion.visibility import sees
from deixis_schemas.anatomy import FACE_WIDTH_M

from ..bearings import azimuth_of, heading_to
from ..geometry import RobotState, View, view_at, wrap_deg
from .ground import Ground, GroundPoi, Point
from .places import Place, sees_point

Hidden = Literal["wall", "behind", "here"]
"""Why nobody at a place points at a POI: a wall between, it lies at the person's back, the person stands on it."""

BEHIND_DEG = 150.0
"""People who face the robot do not point farther back than this."""
TOWARD_CAMERA_DEG = 25.0
"""Below this bearing the hand is in front of the body, seen end-on: fusion's `hand.min_deg`."""
CLOSE_DEG = 12.0
"""Two POIs nearer to each other than this, seen from a place, are hardly told apart: hand and head err by as much."""
HERE_M = 0.3
SHOULDER_M, HALF_SHOULDERS_M, ARM_M = 1.42, 0.19, 0.68
"""Of somebody 1.75 m tall: height of the shoulder, half the distance between both, shoulder to fingertip."""
SMALL_FACE_PX = 26.0
"""A face narrower than this is near the smallest that the tracker looks for (22 pixels)."""


@dataclass(frozen=True)
class Aim:
    """One POI as somebody at a place sees it.

    azimuth_deg: at the person from the direction to the camera, positive toward the person's own left. hidden: why it is not
    pointed at, none where it is. hand_in_picture: whether the fingertip of an arm stretched toward it is in the picture.
    beyond_reach: whether the head is out of range while it looks there.
    """

    place: Place
    poi: GroundPoi
    azimuth_deg: float
    hidden: Hidden | None
    hand_in_picture: bool
    beyond_reach: bool

    @property
    def toward_camera(self) -> bool:
        """Whether the arm points about at the camera."""
        return abs(self.azimuth_deg) < TOWARD_CAMERA_DEG


@dataclass(frozen=True)
class ClosePair:
    """Two POIs that lie within CLOSE_DEG of each other seen from a place."""

    place: Place
    first: GroundPoi
    second: GroundPoi
    gap_deg: float


def aims_of(ground: Ground, places: Sequence[Place]) -> list[Aim]:
    """Each POI from each place, in their order."""
    view = view_at(ground.camera, RobotState())
    return [_aim(ground, view, place, poi) for place in places for poi in ground.pois]


def close_pairs(aims: Sequence[Aim], close_deg: float = CLOSE_DEG) -> list[ClosePair]:
    """Pairs of POIs that are pointed at and lie too close together, the closest first."""
    shown = [aim for aim in aims if aim.hidden is None]
    pairs = [
        ClosePair(a.place, a.poi, b.poi, gap)
        for a, b in combinations(shown, 2)
        if a.place == b.place and (gap := abs(wrap_deg(a.azimuth_deg - b.azimuth_deg))) < close_deg
    ]
    return sorted(pairs, key=lambda pair: pair.gap_deg)


def face_px(ground: Ground, place: Place) -> float:
    """Width of a face at that place in the picture, pixels."""
    x, y, z = ground.camera.position_m
    return ground.camera.focal_px * FACE_WIDTH_M / math.dist((x, y, z), (*place.position_m, 1.62))


def _aim(ground: Ground, view: View, place: Place, poi: GroundPoi) -> Aim:
    azimuth = azimuth_of(place.position_m, ground.camera_foot, poi.on_floor)
    return Aim(
        place=place,
        poi=poi,
        azimuth_deg=azimuth,
        hidden=_hidden(ground, place, poi, azimuth),
        hand_in_picture=sees_point(view, fingertip_m(place.position_m, ground.camera_foot, poi, azimuth)),
        beyond_reach=abs(azimuth) > ground.head_range_deg,
    )


def _hidden(ground: Ground, place: Place, poi: GroundPoi, azimuth: float) -> Hidden | None:
    if math.dist(place.position_m, poi.on_floor) < HERE_M:
        return "here"
    if not sees(place.position_m, poi.on_floor, ground.walls, ground.clearance_m):
        return "wall"
    return "behind" if abs(azimuth) > BEHIND_DEG else None


def fingertip_m(person: Point, camera: Point, poi: GroundPoi, azimuth: float) -> tuple[float, float, float]:
    """Fingertip of an arm stretched toward a POI, on the side where the POI lies; robot's frame, metres."""
    facing = math.radians(heading_to(person, camera))
    side = HALF_SHOULDERS_M if azimuth > 0 else -HALF_SHOULDERS_M
    shoulder = person[0] - side * math.sin(facing), person[1] + side * math.cos(facing), SHOULDER_M
    way = [there - here for there, here in zip(poi.position_m, shoulder, strict=True)]
    length = max(math.hypot(*way), 1e-9)
    x, y, z = (here + ARM_M * step / length for here, step in zip(shoulder, way, strict=True))
    return x, y, z
