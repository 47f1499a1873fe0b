"""Where everything is: camera, persons, POIs. Drawn again until head and raised hand are in the picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .bearings import heading_to, place_at
from .dice import Dice
from .draw_bodies import Body
from .draw_lens import Overrides, draw_fov
from .draw_plan import Move, Plan
from .draw_pois import draw_pois
from .draw_scripts import CAMERA, Standing, draw_others, draw_script, draw_standing, duration_of, person_of
from .framing import Sight, fits, head_sights, pitch_to, pointing_sights, quiet_sights
from .geometry import wrap_deg
from .scene import Action, Camera, Person, Place, Pointing, Quiet, ScenePoi, Waypoint

ATTEMPTS = 2000
CAMERA_HEIGHT_M = (0.6, 1.7)
PITCH_LIMIT_DEG = 30.0
ELBOW_ROOM_M = 0.8
"""Between people; their bodies do not overlap, their outstretched arms may."""
SEEN_APART_M = 0.5
"""The same across the line of sight, so that none hides another for good."""


class DrawingError(ValueError):
    """No scene fits what was asked for."""


@dataclass(frozen=True)
class Layout:
    """Places, people and what they do; the camera's size is not drawn here."""

    camera: Camera
    robot_path: list[Waypoint]
    people: list[Person]
    pois: list[ScenePoi]
    duration_s: float


def draw_layout(dice: Dice, plan: Plan, bodies: Sequence[Body], overrides: Overrides) -> Layout:
    """The first layout that fits the picture. Raises DrawingError where none does."""
    for _ in range(ATTEMPTS):
        layout = _attempt(dice, plan, bodies, overrides)
        if layout is not None:
            return layout
    raise DrawingError(f"no scene with head and hand in the picture among {ATTEMPTS}; is the field of view too narrow?")


def _attempt(dice: Dice, plan: Plan, bodies: Sequence[Body], overrides: Overrides) -> Layout | None:
    fov_deg = draw_fov(dice, overrides)
    height_m = dice.between(*CAMERA_HEIGHT_M, 2)
    standing = draw_standing(dice, plan, fov_deg)
    places = _draw_places(dice, standing, len(bodies), fov_deg)
    if places is None:
        return None
    ways = [(standing.start, standing.place), *((CAMERA, place) for place in (standing.place, *places)), (CAMERA, (0.8, 0.0))]
    pois = draw_pois(dice, standing.place, CAMERA, ways)
    script = draw_script(dice, plan, standing, pois)
    if script is None:
        return None
    people = [person_of(body, standing, script) for body in bodies[:1]] + draw_others(dice, plan, bodies[1:], places, pois)
    duration_s = duration_of(dice, people)
    path = _draw_path(dice, plan.move, duration_s)
    sights = _sights(people, standing, places, pois, duration_s, hands=not plan.hand_may_leave)
    camera = _mounted(dice, fov_deg, height_m, sights)
    if camera is None or not fits(sights, camera, path) or _stabs(people, standing, places, pois):
        return None
    return Layout(camera, path, people, pois, duration_s)


def _mounted(dice: Dice, fov_deg: float, height_m: float, sights: Sequence[Sight]) -> Camera | None:
    position = (0.0, 0.0, height_m)
    tilt = dice.near(0, 4, -12, 12, 2)
    level, aslant = dice.near(0, 1.2, -4, 4, 2), dice.between(-9, 9, 2)
    roll = aslant if dice.chance(0.18) else level
    pitch = (pitch_to(sights, position) if sights else 0.0) + tilt
    if abs(pitch) > PITCH_LIMIT_DEG:
        return None
    return Camera(horizontal_fov_deg=fov_deg, position_m=position, pitch_up_deg=round(pitch, 2), roll_deg=roll)


def _draw_places(dice: Dice, first: Standing, people: int, fov_deg: float) -> list[Place] | None:
    """Places of all but the first; none where they come too near."""
    places: list[Place] = []
    for _ in range(people - 1):
        x, y = place_at(CAMERA, dice.between(-0.44, 0.44) * fov_deg, dice.between(1.2, 3.8))
        place = (round(x, 3), round(y, 3))
        if any(_too_near(place, other) for other in (first.place, *places)):
            return None
        places.append(place)
    return places


def _too_near(place: Place, other: Place) -> bool:
    apart = wrap_deg(heading_to(CAMERA, place) - heading_to(CAMERA, other))
    across = math.sin(math.radians(min(abs(apart), 90.0))) * min(math.dist(place, CAMERA), math.dist(other, CAMERA))
    return math.dist(place, other) < ELBOW_ROOM_M or across < SEEN_APART_M


def _draw_path(dice: Dice, move: Move, duration_s: float) -> list[Waypoint]:
    """Stands, turns on the spot, or drives a little; it begins at the map's origin."""
    begin_s, over_s = dice.between(0.2, 1.5, 2), dice.between(1.2, 3.0, 2)
    turn_deg, side = dice.between(5, 22, 1), dice.one((-1, 1))
    ahead_m, aside_m, sway_deg = dice.between(-0.5, 0.6, 2), dice.between(-0.15, 0.15, 2), dice.between(-6, 6, 1)
    back = dice.chance(0.4)
    if move == "none":
        return []
    there = (0.0, 0.0, side * turn_deg) if move == "pan" else (ahead_m, aside_m, sway_deg)
    end_s = min(begin_s + over_s, duration_s)
    path = [
        Waypoint(at_s=begin_s),
        Waypoint(at_s=round(end_s, 2), x_m=there[0], y_m=there[1], yaw_deg=there[2]),
    ]
    return [*path, Waypoint(at_s=round(end_s + over_s, 2))] if back else path


def _sights(
    people: Sequence[Person],
    first: Standing,
    places: Sequence[Place],
    pois: Sequence[ScenePoi],
    duration_s: float,
    *,
    hands: bool,
) -> list[Sight]:
    """What has to be in the picture: heads all the time (of who walks: while it acts), hands while they are raised."""
    sights = []
    for person, place in zip(people, (first.place, *places), strict=False):
        walks = person.place_m != place
        heading = first.heading_deg if walks else person.heading_deg
        acts = [action for action in person.actions if isinstance(action, Pointing | Quiet)]
        if walks and not acts:
            middle = ((person.place_m[0] + place[0]) / 2, (person.place_m[1] + place[1]) / 2)
            sights += head_sights(middle, person.height_m, duration_s / 2)
        begin_s = min([action.start_s for action in acts], default=duration_s) if walks else 0.0
        if not walks or acts:
            times = (begin_s, (begin_s + duration_s) / 2, duration_s)
            sights += [sight for time_s in times for sight in head_sights(place, person.height_m, time_s)]
        sights += [sight for action in acts if hands for sight in _hand(action, place, heading, person.height_m, pois)]
    return sights


def _hand(action: Action, place: Place, heading_deg: float, height_m: float, pois: Sequence[ScenePoi]) -> list[Sight]:
    if isinstance(action, Pointing):
        target = next(poi.position_m for poi in pois if poi.poi_id == action.poi)
        return pointing_sights(place, heading_deg, height_m, action, target)
    return quiet_sights(place, heading_deg, height_m, action) if isinstance(action, Quiet) else []


def _stabs(people: Sequence[Person], first: Standing, places: Sequence[Place], pois: Sequence[ScenePoi]) -> bool:
    """Whether a pointing hand ends within another person."""
    stands = [first.place, *places]
    for number, person in enumerate(people):
        others = [place for index, place in enumerate(stands) if index != number]
        heading = first.heading_deg if number == 0 else person.heading_deg
        for action in person.actions:
            hand = _hand(action, stands[number], heading, person.height_m, pois)
            if any(math.dist(sight.position_m[:2], other) < 0.35 for sight in hand for other in others):
                return True
    return False
