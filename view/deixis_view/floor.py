"""The place from above: robot and what its camera sees, people and where head and hand point, walls, and POIs by belief.

The view has the map's x axis up and its y axis to the left, as the robot sees it that stands at the origin: (x, y) of the map,
metres, is (-y, -x) of the view, whose y axis goes down.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from deixis_cli import wording
from deixis_runtime.site import WallLine
from deixis_schemas.messages import Belief, CameraInfo, Gesture, HeadPose, PersonBelief, Poi, RobotPose

from . import colours
from .colours import Colour
from .drawing import Dots, Drawing, Lines, Point2
from .frame_view import FrameView
from .known import Known

ROOT = "map"
SHORTEST_SIGHT_M, LONGEST_SIGHT_M = 1.5, 10.0
FIELD_OF_VIEW_M = 1.2
ROBOT_RADIUS_M, PERSON_RADIUS_M = 0.2, 0.16
LEAST_POI_RADIUS_M, MOST_POI_RADIUS_M = 0.09, 0.19
SIDE_MARGIN_M, MARGIN_M = 1.0, 0.6  # names are written across
WORTH_SAYING = 0.15
"""How probable a POI has to be for its figure to be written."""
MOST_NAMED = 40
"""Of more POIs than that, only the probable ones are written to."""
WIDE, NARROW = 3.0, 1.0


def shown(x_m: float, y_m: float) -> Point2:
    """A point of the map as the view has it."""
    return -y_m, -x_m


def draw_place(known: Known) -> list[Drawing]:
    """What stands: walls, and the robot with its camera's field of view."""
    pose = known.robot
    drawings = [Drawing(f"{ROOT}/walls", _walls(known.walls))]
    if pose is not None:
        drawings.append(Drawing(f"{ROOT}/robot", _robot(pose)))
        drawings.append(Drawing(f"{ROOT}/robot/field_of_view", _field_of_view(pose, known.camera)))
    return drawings


def draw_people(view: FrameView, known: Known) -> list[Drawing]:
    """What one frame says: POIs by belief, people, sight lines, and what is named."""
    persons = view.belief.persons if view.belief else []
    placed = [person for person in persons if person.position_m is not None]
    return [
        Drawing(f"{ROOT}/pois", _pois(known.pois, chances(view.belief))),
        Drawing(f"{ROOT}/named", _named(known)),
        Drawing(f"{ROOT}/people", _people(placed)),
        Drawing(f"{ROOT}/heads", _sight_lines(placed, known, _head_sights(view))),
        Drawing(f"{ROOT}/hands", _sight_lines(placed, known, _hand_sights(view))),
    ]


def chances(belief: Belief | None) -> dict[str, float]:
    """How probable each POI is meant, by id: of several people, by whom it is meant most."""
    found: dict[str, float] = {}
    for person in belief.persons if belief else []:
        for poi in person.pois:
            found[poi.poi_id] = max(found.get(poi.poi_id, 0.0), wording.chance(poi))
    return found


def bounds(known: Known) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of what the view should show: POIs, robot and walls, or some metres before the robot."""
    points = [shown(*poi.position_m[:2]) for poi in known.pois.values()]
    points += [shown(*end) for wall in known.walls for end in wall] if not points else []
    robot = known.robot
    points.append(shown(robot.x_m, robot.y_m) if robot else (0.0, 0.0))
    if len(points) == 1:
        points += [shown(5.0, 2.5), shown(5.0, -2.5)]
    across, down = [p[0] for p in points], [p[1] for p in points]
    return min(across) - SIDE_MARGIN_M, min(down) - MARGIN_M, max(across) + SIDE_MARGIN_M, max(down) + MARGIN_M


def camera_place(pose: RobotPose, camera: CameraInfo | None) -> tuple[Point2, float]:
    """Where the camera is in the map, x and y in metres, and which way it looks, radians from the map's x axis."""
    heading = math.radians(pose.yaw_deg)
    if camera is None:
        return (pose.x_m, pose.y_m), heading
    x, y, _ = camera.mount.position_m
    at = (
        pose.x_m + x * math.cos(heading) - y * math.sin(heading),
        pose.y_m + x * math.sin(heading) + y * math.cos(heading),
    )
    return at, heading + math.radians(camera.mount.yaw_deg)


def direction(person: Point2, camera: Point2, bearing_deg: float) -> float:
    """A bearing at the person as an angle in the map, radians: it counts from the camera, counter-clockwise from above."""
    return math.atan2(camera[1] - person[1], camera[0] - person[0]) + math.radians(bearing_deg)


def sight_line(person: Point2, angle: float, length_m: float) -> list[Point2]:
    """A line from the person, in coordinates of the view."""
    return [shown(*person), shown(person[0] + length_m * math.cos(angle), person[1] + length_m * math.sin(angle))]


Sight = tuple[float, float, str, Colour]
"""Bearing and its standard deviation, degrees, what it is, and its colour."""


def _head_sights(view: FrameView) -> dict[int, Sight]:
    return {pose.person_id: sight for pose in (view.poses.poses if view.poses else []) if (sight := _head(pose)) is not None}


def _head(pose: HeadPose) -> Sight | None:
    if pose.status != "tracking" or pose.yaw_deg is None or pose.yaw_sigma_deg is None:
        return None
    return pose.yaw_deg, pose.yaw_sigma_deg, "head", colours.FACE


def _hand_sights(view: FrameView) -> dict[int, Sight]:
    gestures = view.gestures.gestures if view.gestures else []
    return {gesture.person_id: sight for gesture in gestures if (sight := _hand(gesture)) is not None}


def _hand(gesture: Gesture) -> Sight | None:
    if gesture.bearing_deg is None or gesture.bearing_sigma_deg is None:
        return None
    return gesture.bearing_deg, gesture.bearing_sigma_deg, "hand", colours.HANDS[gesture.hand or "right"]


def _sight_lines(placed: Sequence[PersonBelief], known: Known, sights: Mapping[int, Sight]) -> Lines:
    """Of each person a line along the bearing, and two thin ones a standard deviation beside it."""
    lines = Lines()
    pose = known.robot
    for person in placed if pose is not None else []:
        if person.person_id not in sights or person.position_m is None or pose is None:
            continue
        bearing, sigma, what, colour = sights[person.person_id]
        at = person.position_m[:2]
        camera, _ = camera_place(pose, known.camera)
        length_m = _reach(at, known.pois)
        for offset, width in ((0.0, WIDE), (-sigma, NARROW), (sigma, NARROW)):
            lines.strips.append(sight_line(at, direction(at, camera, bearing + offset), length_m))
            lines.widths.append(width)
            lines.colours.append(colour)
            lines.labels.append("" if offset else what)
    return lines


def _reach(person: Point2, pois: Mapping[str, Poi]) -> float:
    """How long a sight line is: past the farthest POI."""
    farthest = max((math.dist(person, poi.position_m[:2]) for poi in pois.values()), default=0.0)
    return min(LONGEST_SIGHT_M, max(SHORTEST_SIGHT_M, farthest))


def _walls(walls: Sequence[WallLine]) -> Lines:
    strips = [[shown(*first), shown(*second)] for first, second in walls]
    return Lines(strips, [2.0] * len(strips), [], [colours.WALL] * len(strips))


def _robot(pose: RobotPose) -> Lines:
    """A triangle whose tip shows where the robot looks."""
    heading = math.radians(pose.yaw_deg)
    corners = [(heading + turn, ROBOT_RADIUS_M * size) for turn, size in ((0, 1.5), (2.4, 1), (-2.4, 1), (0, 1.5))]
    strip = [shown(pose.x_m + radius * math.cos(angle), pose.y_m + radius * math.sin(angle)) for angle, radius in corners]
    return Lines([strip], [2.5], ["robot"], [colours.ROBOT])


def _field_of_view(pose: RobotPose, camera: CameraInfo | None) -> Lines:
    """The edges of what the camera sees, level and without its distortion."""
    if camera is None or camera.camera_matrix is None or not camera.width:
        return Lines()
    at, looks = camera_place(pose, camera)
    focal, centre = camera.camera_matrix[0], camera.camera_matrix[2]
    edges = (math.atan2(centre, focal), -math.atan2(camera.width - centre, focal))
    strips = [sight_line(at, looks + edge, FIELD_OF_VIEW_M) for edge in edges]
    return Lines(strips, [NARROW] * 2, [], [colours.ROBOT] * 2)


def _people(placed: Sequence[PersonBelief]) -> Dots:
    points = [shown(*person.position_m[:2]) for person in placed if person.position_m is not None]
    labels = [f"person {person.person_id}" for person in placed]
    return Dots(points, [PERSON_RADIUS_M] * len(points), labels, [colours.PERSON] * len(points))


def _pois(pois: Mapping[str, Poi], chance_of: Mapping[str, float]) -> Dots:
    dots = Dots()
    for poi_id, poi in pois.items():
        chance = chance_of.get(poi_id, 0.0)
        dots.points.append(shown(*poi.position_m[:2]))
        dots.radii.append(LEAST_POI_RADIUS_M + chance * (MOST_POI_RADIUS_M - LEAST_POI_RADIUS_M))
        dots.colours.append(colours.of_belief(chance))
        dots.labels.append(_label(poi, chance, few=len(pois) <= MOST_NAMED))
    return dots


def _label(poi: Poi, chance: float, *, few: bool) -> str:
    if chance >= WORTH_SAYING:
        return f"{poi.name or poi.poi_id} {chance:.2f}"
    return (poi.name or poi.poi_id) if few else ""


def _named(known: Known) -> Lines:
    """A ring around each POI of the answer."""
    target = known.target
    lines = Lines()
    for poi_id in target.poi_ids if target is not None else []:
        if poi_id in known.pois:
            lines.strips.append(list(_ring(known.pois[poi_id].position_m[:2])))
            lines.widths.append(WIDE)
            lines.colours.append(colours.FULL_BELIEF)
    return lines


def _ring(centre: Point2, radius_m: float = 1.6 * MOST_POI_RADIUS_M, corners: int = 32) -> Iterator[Point2]:
    for corner in range(corners + 1):
        angle = 2 * math.pi * corner / corners
        yield shown(centre[0] + radius_m * math.cos(angle), centre[1] + radius_m * math.sin(angle))
