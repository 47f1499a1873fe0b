"""Where everything is: camera, persons, POIs. Drawn again until head and raised hand are in the picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .bearings import heading_to, place_at
from .dice import Dice
from .draw_bodies import Body
from .draw_lens import Overrides, draw_fov
from .draw_manner import Manner
from .draw_mount import draw_mount
from .draw_plan import Move, Plan
from .draw_pois import draw_pois
from .draw_scripts import draw_others, draw_script, duration_of, person_of
from .draw_stand import CAMERA, Standing, Stands, draw_standing
from .framing import Sight, fits, head_sights, pointing_sights, quiet_sights
from .geometry import wrap_deg
from .scene import Action, Camera, Person, Place, Pointing, Quiet, ScenePoi, Waypoint

ATTEMPTS = 2000
HAND_ROOM_M = 0.35
ELBOW_ROOM_M = 0.8
"""Between people; their bodies do not overlap, their outstretched arms may."""


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


def draw_layout(dice: Dice, plan: Plan, bodies: Sequence[Body], overrides: Overrides, manner: Manner) -> Layout:
    """The first layout that fits the picture. Raises DrawingError where none does."""
    for _ in range(ATTEMPTS):
        layout = _attempt(dice, plan, bodies, overrides, manner)
        if layout is not None:
            return layout
    raise DrawingError(f"no scene with head and hand in the picture among {ATTEMPTS}; is the field of view too narrow?")


def _attempt(dice: Dice, plan: Plan, bodies: Sequence[Body], overrides: Overrides, manner: Manner) -> Layout | None:
    fov_deg = draw_fov(dice, overrides, manner.optics)
    height_m = dice.between(*manner.mounts.height_m, 2)
    standing = draw_standing(dice, plan, fov_deg, manner.stands)
    places = _draw_places(dice, standing, len(bodies), fov_deg, manner.stands)
    if places is None:
        return None
    ways = [(standing.start, standing.place), *((CAMERA, place) for place in (standing.place, *places)), (CAMERA, (0.8, 0.0))]
    pois = draw_pois(dice, standing.place, CAMERA, ways, manner.spread)
    if not (manner.spread.always_seen or plan.points):
        pois = [poi.model_copy(update={"exhibit": None}) for poi in pois]
    script = draw_script(dice, plan, standing, pois, manner)
    if script is None:
        return None
    people = [person_of(body, standing, script) for body in bodies[:1]] + draw_others(
        dice, plan, bodies[1:], places, pois, manner
    )
    duration_s = duration_of(dice, people)
    path = _draw_path(dice, plan.move, duration_s)
    sights = _sights(people, standing, places, pois, duration_s, hands=not plan.hand_may_leave)
    camera = draw_mount(dice, manner.mounts, fov_deg, height_m, math.dist(standing.place, CAMERA), sights)
    if camera is None or not fits(sights, camera, path, manner.mounts.frame):
        return None
    if _meets(people, standing, places, pois, manner.stands.clear_m):
        return None
    return Layout(camera, path, people, pois, duration_s)


def _draw_places(dice: Dice, first: Standing, people: int, fov_deg: float, stands: Stands) -> list[Place] | None:
    """Places of all but the first; none where they come too near."""
    places: list[Place] = []
    for _ in range(people - 1):
        x, y = place_at(
            CAMERA, dice.between(-stands.others_aside, stands.others_aside) * fov_deg, dice.between(*stands.others_distance_m)
        )
        place = (round(x, 3), round(y, 3))
        if any(_too_near(place, other, stands.apart_m) for other in (first.place, *places)):
            return None
        places.append(place)
    return places


def _too_near(place: Place, other: Place, apart_m: float) -> bool:
    return math.dist(place, other) < ELBOW_ROOM_M or _across_m(place, other) < apart_m


def _across_m(place: Place, other: Place) -> float:
    """How far apart the camera sees two places, at the distance of the nearer one."""
    apart = wrap_deg(heading_to(CAMERA, place) - heading_to(CAMERA, other))
    return math.sin(math.radians(min(abs(apart), 90.0))) * min(math.dist(place, CAMERA), math.dist(other, CAMERA))


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


def _meets(
    people: Sequence[Person], first: Standing, places: Sequence[Place], pois: Sequence[ScenePoi], clear_m: float
) -> bool:
    """Whether a pointing hand ends within another person, or is seen so near to one, before or behind, as `clear_m`."""
    stands = [first.place, *places]
    for number, person in enumerate(people):
        others = [place for index, place in enumerate(stands) if index != number]
        heading = first.heading_deg if number == 0 else person.heading_deg
        for action in person.actions:
            hand = _hand(action, stands[number], heading, person.height_m, pois)
            ends = [(sight.position_m[:2], other) for sight in hand for other in others]
            if any(math.dist(end, other) < HAND_ROOM_M or _across_m(end, other) < clear_m for end, other in ends):
                return True
    return False
