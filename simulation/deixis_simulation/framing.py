"""Whether the camera has head and hand in its picture, by roughly where they will be. The picture is taken as 16:9, the
lowest that is drawn, so that a scene fits whatever its size.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .bearings import place_at
from .geometry import robot_at, to_world, view_at
from .scene import Camera, Place, Pointing, Position, Quiet, Waypoint

LOWEST_ASPECT = 9 / 16
CHIN, TOP = 0.87, 1.0
"""Heights of the head's ends, of the body's height."""
SHOULDER, SHOULDER_SIDE, ARM = 0.81, 0.11, 0.43
REACH = {"straight": 1.0, "bent": 0.75, "hip": 0.5}


@dataclass(frozen=True)
class Frame:
    """What counts as in the picture: `margin` from every side, of the picture's width, in pictures that are `lowest_aspect` of
    their width high, and at least `nearest_m` before the lens.
    """

    lowest_aspect: float = LOWEST_ASPECT
    margin: float = 0.02
    nearest_m: float = 0.3


ANY_FRAME = Frame()


@dataclass(frozen=True)
class Sight:
    """A place that should be in the picture at a time. Map, metres."""

    time_s: float
    position_m: Position


def head_sights(place: Place, height_m: float, time_s: float) -> list[Sight]:
    """Top and chin of the head of who stands there."""
    return [Sight(time_s, (*place, share * height_m)) for share in (CHIN, TOP)]


def pointing_sights(place: Place, heading_deg: float, height_m: float, pointing: Pointing, target: Position) -> list[Sight]:
    """The fingertip at begin and end of the stroke."""
    side = 90.0 if pointing.arm == "left" else -90.0
    shoulder = np.array([*place_at(place, heading_deg + side, SHOULDER_SIDE * height_m), SHOULDER * height_m])
    if pointing.style == "hip":
        shoulder[2] -= 0.12 * height_m
    way = np.array(target) - shoulder
    tip = shoulder + way / np.linalg.norm(way) * ARM * REACH[pointing.style] * height_m
    begin = pointing.start_s + pointing.preparation_s
    return [Sight(time_s, (float(tip[0]), float(tip[1]), float(tip[2]))) for time_s in (begin, begin + pointing.hold_s)]


def quiet_sights(place: Place, heading_deg: float, height_m: float, gesture: Quiet) -> list[Sight]:
    """Roughly where the hand of a quiet gesture is: beside the head."""
    side = 90.0 if gesture.arm == "left" else -90.0
    hand = place_at(place, heading_deg + side, 0.17 * height_m)
    return [Sight(gesture.start_s + gesture.preparation_s, (*hand, 0.85 * height_m))]


def pitch_to(sights: Sequence[Sight], camera_m: Position) -> float:
    """Tilt that has the middle of these sights in the middle of the picture, degrees up."""
    angles = [_elevation_deg(sight.position_m, camera_m) for sight in sights]
    return (min(angles) + max(angles)) / 2


def fits(sights: Sequence[Sight], camera: Camera, path: Sequence[Waypoint], frame: Frame = ANY_FRAME) -> bool:
    """Whether all of these are in the picture, whatever its height may be from the frame's on."""
    height = int(camera.width * frame.lowest_aspect)
    low = camera.model_copy(update={"height": height})
    edge = frame.margin * camera.width
    for sight in sights:
        view = view_at(low, robot_at(path, sight.time_s))
        point = to_world(sight.position_m)
        if view.in_camera(point)[2] < frame.nearest_m:
            return False
        x, y = view.project(point)
        if not (edge <= x < low.width - edge and edge <= y < height - edge):
            return False
    return True


def _elevation_deg(position_m: Position, camera_m: Position) -> float:
    away = math.dist(position_m[:2], camera_m[:2])
    return math.degrees(math.atan2(position_m[2] - camera_m[2], away))
