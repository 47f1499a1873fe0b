"""Where visitors can stand: in the camera's view, near enough, with no wall between; given, or chosen so that they differ."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from deixis_fusion.visibility import sees

from ..geometry import RobotState, View, to_world, view_at
from .ground import Ground, Point, RehearsalError, Wall

NEAREST_M, FARTHEST_M = 1.1, 3.5
NEAREST_CHOSEN_M, USUAL_M, FARTHEST_CHOSEN_M = 1.5, 2.0, 3.0
HEAD_M = 1.62
"""Height of the head of somebody of usual size; of the chest: `CHEST_M`."""
CHEST_M = 1.25
HALF_BODY_M = 0.25
HALF_REACH_M = 0.6
"""Room to either side of a chosen place, so that a hand stays in the picture."""
FROM_WALLS_M = 0.35
FROM_POIS_M = 0.5
MOST_PLACES = 26
GRID_M, GRID_DEG = 0.25, 3.0
TOO_ALIKE_M = 0.4


@dataclass(frozen=True)
class Place:
    """Where somebody stands. `letter` names it in tables and on the map; robot's frame and the site's map, metres."""

    letter: str
    position_m: Point
    in_map_m: Point

    @property
    def words(self) -> str:
        """As it is spoken of."""
        return f"{self.letter} ({self.in_map_m[0]:.1f}, {self.in_map_m[1]:.1f})"


def given_places(ground: Ground, in_map: Sequence[Point]) -> list[Place]:
    """Places from the command line, in the site's map. Raises RehearsalError that says what is wrong with the first bad one."""
    if len(in_map) > MOST_PLACES:
        raise RehearsalError(f"--from: {len(in_map)} places; {MOST_PLACES} at most")
    view = view_at(ground.camera, RobotState())
    positions = [ground.frame.of_map(point) for point in in_map]
    for point, position in zip(in_map, positions, strict=True):
        trouble = trouble_at(ground, view, position)
        if trouble is not None:
            raise RehearsalError(f"--from {point[0]:g},{point[1]:g}: {trouble}")
    return _named(ground, positions)


def chosen_places(ground: Ground, number: int) -> list[Place]:
    """Up to `number` places that differ: the first about 2 m ahead, each other one far from those before.

    Raises RehearsalError where the camera sees nobody anywhere.
    """
    free = _grid(ground)
    if not free:
        raise RehearsalError(
            f"the camera sees no place {NEAREST_CHOSEN_M} to {FARTHEST_CHOSEN_M} m off where one could stand with head and "
            "chest in the picture and see a POI: are camera.mount (height, pitch_up_deg, yaw_deg), robot_pose and walls right?"
        )
    ahead = _ahead(ground)
    chosen = [min(free, key=lambda place: math.dist(place, ahead))]
    while len(chosen) < min(number, MOST_PLACES):
        farthest = max(free, key=lambda place: min(math.dist(place, other) for other in chosen))
        if min(math.dist(farthest, other) for other in chosen) < TOO_ALIKE_M:
            break
        chosen.append(farthest)
    return _named(ground, chosen)


def trouble_at(ground: Ground, view: View, position: Point, half_width_m: float = HALF_BODY_M) -> str | None:
    """Why nobody can be rehearsed there, in words; none where one can. Robot's frame, metres."""
    foot = ground.camera_foot
    distance = math.dist(foot, position)
    if not NEAREST_M <= distance <= FARTHEST_M:
        return f"is {distance:.1f} m from the camera, and people are told from {NEAREST_M} to {FARTHEST_M} m"
    if _wall_distance(position, ground.walls) < FROM_WALLS_M:
        return f"is less than {FROM_WALLS_M} m from a wall"
    if not sees(foot, position, ground.walls, 0.0):
        return "the camera does not see it: a wall is between"
    return None if in_picture(view, position, half_width_m) else "somebody there is not in the picture with head and chest"


def in_picture(view: View, position: Point, half_width_m: float) -> bool:
    """Whether head and chest of somebody there are in the picture, and so much to either side."""
    to_side = _to_side(view, position)
    sides = [
        (position[0] + sign * half_width_m * to_side[0], position[1] + sign * half_width_m * to_side[1]) for sign in (-1, 1)
    ]
    points = [(*position, HEAD_M), *((*side, CHEST_M) for side in sides)]
    return all(sees_point(view, point) for point in points)


def sees_point(view: View, point: Sequence[float]) -> bool:
    """Whether a point of the robot's frame (x, y, z, metres) is in the picture."""
    world = to_world(point)
    if view.in_camera(world)[2] < 0.1:
        return False
    u, v = view.project(world)
    return bool(0 <= u < view.width and 0 <= v < view.height)


def _grid(ground: Ground) -> list[Point]:
    view = view_at(ground.camera, RobotState())
    foot, middle = ground.camera_foot, math.radians(ground.camera.yaw_deg)
    half = ground.camera.horizontal_fov_deg / 2
    found = []
    for ring in range(int((FARTHEST_CHOSEN_M - NEAREST_CHOSEN_M) / GRID_M) + 1):
        distance = NEAREST_CHOSEN_M + ring * GRID_M
        for step in range(-int(half / GRID_DEG), int(half / GRID_DEG) + 1):
            angle = middle + math.radians(step * GRID_DEG)
            position = round(foot[0] + distance * math.cos(angle), 2), round(foot[1] + distance * math.sin(angle), 2)
            if _is_good(ground, view, position):
                found.append(position)
    return found


def _is_good(ground: Ground, view: View, position: Point) -> bool:
    if any(math.dist(position, poi.on_floor) < FROM_POIS_M for poi in ground.pois):
        return False
    if trouble_at(ground, view, position, HALF_REACH_M) is not None:
        return False
    return any(sees(position, poi.on_floor, ground.walls, ground.clearance_m) for poi in ground.pois)


def _ahead(ground: Ground) -> Point:
    yaw = math.radians(ground.camera.yaw_deg)
    return ground.camera_foot[0] + USUAL_M * math.cos(yaw), ground.camera_foot[1] + USUAL_M * math.sin(yaw)


def _to_side(view: View, position: Point) -> Point:
    """Unit vector across the line from the camera to the place, robot's frame."""
    centre = view.centre
    # World is X = -y, Z = -x.
    dx, dy = position[0] + float(centre[2]), position[1] + float(centre[0])
    length = max(math.hypot(dx, dy), 1e-9)
    return -dy / length, dx / length


def _wall_distance(point: Point, walls: Sequence[Wall]) -> float:
    return min((_segment_distance(point, *wall) for wall in walls), default=math.inf)


def _segment_distance(point: Point, a: Point, b: Point) -> float:
    dx, dy = b[0] - a[0], b[1] - a[1]
    square = dx * dx + dy * dy
    share = 0.0 if square == 0 else min(max(((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / square, 0.0), 1.0)
    return math.dist(point, (a[0] + share * dx, a[1] + share * dy))


def _named(ground: Ground, positions: Sequence[Point]) -> list[Place]:
    return [Place(chr(ord("A") + i), position, ground.frame.to_map(position)) for i, position in enumerate(positions)]
