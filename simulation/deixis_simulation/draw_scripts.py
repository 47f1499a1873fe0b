"""What the first person and the others do, by the plan."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .bearings import heading_to
from .dice import Dice
from .draw_actions import draw_nods, draw_pointings, draw_quiet, draw_quiets, draw_turns
from .draw_bodies import Body
from .draw_manner import Manner
from .draw_plan import Plan
from .draw_stand import CAMERA, Standing, draw_front
from .geometry import wrap_deg
from .scene import Action, Person, Place, ScenePoi, Walk

LONGEST_S = 7.0
SHORTEST_S = 4.0
WALK_PACE_M_S = (0.8, 1.5)
WALK_RAMPS_S = 0.6
"""What starting and stopping add to the time that a way takes at full pace."""
TURN_S, TURN_DEG_PER_S = 0.25, 200.0
"""How long a walker takes to turn to where it faces then."""
SETTLE_S = (-0.3, 0.4)
"""Between the end of the walk and what follows: some begin while they still turn."""


def draw_script(dice: Dice, plan: Plan, standing: Standing, pois: Sequence[ScenePoi], manner: Manner) -> list[Action] | None:
    """Actions of the first person; none where the plan cannot be done with these POIs or not in time."""
    habits = manner.habits
    row, start_s = _draw_walk(dice, plan, standing, manner)
    if plan.points:
        if plan.gesture_before:
            before = draw_quiet(dice, start_s, habits)
            row, start_s = [*row, before], before.end_s + 0.3
        pointings = draw_pointings(dice, start_s, standing.targets(pois), plan.count, habits)
        row = [*row, *pointings]
        if len(pointings) < plan.count:
            return None
    elif plan.plot in ("gestures", "in_gestures"):
        row = [*row, *draw_quiets(dice, start_s, LONGEST_S - 0.4, plan.count, habits)]
    elif plan.plot == "turns":
        row = [*row, *draw_turns(dice, start_s, LONGEST_S - 0.4, standing.front_deg, plan.count, habits)]
    elif plan.plot == "nods":
        row = [*row, *draw_nods(dice, start_s, plan.count)]
    elif plan.plot == "mixed":
        turns = draw_turns(dice, start_s, 3.2, standing.front_deg, 1, habits)
        row = [*row, *turns, *draw_quiets(dice, max(_end_s(turns), start_s) + 0.3, LONGEST_S - 0.4, 1, habits)]
    return row if _end_s(row) <= LONGEST_S - 0.3 else None


def draw_others(
    dice: Dice, plan: Plan, bodies: Sequence[Body], places: Sequence[Place], pois: Sequence[ScenePoi], manner: Manner
) -> list[Person]:
    """The company of the first person: gesture, look about or stand; sometimes one more points."""
    habits, people = manner.habits, []
    for number, (body, place) in enumerate(zip(bodies, places, strict=True)):
        heading = round(wrap_deg(heading_to(place, CAMERA) + draw_front(dice, manner.stands)), 1)
        standing = Standing(place, heading, place)
        start_s, points = dice.between(0.5, 2.0, 2), plan.second_pointer and plan.plot == "point" and number == 0
        acts = dice.weighed({"quiet": 0.4, "turn": 0.25, "idle": 0.35})
        row: list[Action] = []
        if points:
            row = draw_pointings(dice, start_s, standing.targets(pois), 1, habits)
        elif acts == "quiet":
            row = draw_quiets(dice, start_s, LONGEST_S - 0.4, dice.whole(1, 2), habits)
        elif acts == "turn":
            row = draw_turns(dice, start_s, LONGEST_S - 0.4, standing.front_deg, dice.whole(1, 2), habits)
        people.append(person_of(body, standing, [action for action in row if _end_s([action]) < LONGEST_S]))
    return people


def person_of(body: Body, standing: Standing, actions: Sequence[Action]) -> Person:
    """The scene's person: who walks begins at the start of its way, in its direction."""
    heading = heading_to(standing.start, standing.place) if standing.walks else standing.heading_deg
    return Person(
        avatar=body.avatar,
        height_m=body.height_m,
        skin_tint=body.skin_tint,
        clothes_tint=body.clothes_tint,
        hair_tint=body.hair_tint,
        place_m=standing.start,
        heading_deg=round(wrap_deg(heading), 1),
        head_deg=body.head_deg,
        restlessness=body.restlessness,
        actions=list(actions),
    )


def duration_of(dice: Dice, people: Sequence[Person]) -> float:
    """Duration of the clip: some time after the last action."""
    end_s = max([_end_s(person.actions) for person in people], default=0.0) + dice.between(0.3, 0.9, 2)
    idle_s = dice.between(SHORTEST_S, SHORTEST_S + 1, 2)
    return round(min(max(end_s, idle_s if end_s < SHORTEST_S else SHORTEST_S), LONGEST_S), 2)


def _draw_walk(dice: Dice, plan: Plan, standing: Standing, manner: Manner) -> tuple[list[Action], float]:
    """The way there, if any, and when what follows begins."""
    start_s, speed = dice.between(0.5, 1.1, 2), dice.between(*WALK_PACE_M_S, 2)
    glances, carries, settle_s = dice.chance(0.5), dice.chance(manner.stands.carries), dice.between(*SETTLE_S, 2)
    if not standing.walks:
        return [], start_s
    begin_s = dice.between(0, 0.4, 2)
    length = math.dist(standing.start, standing.place)
    if plan.plot == "through":
        speed = max(speed, round(min(length / 5.5, 2.0), 2))
    arrival_s = begin_s + length / speed + WALK_RAMPS_S
    turn = wrap_deg(standing.heading_deg - heading_to(standing.start, standing.place))
    walk = Walk(
        start_s=begin_s,
        to_m=standing.place,
        speed_m_s=speed,
        heading_deg=round(wrap_deg(standing.heading_deg), 1),
        glance_s=(round(arrival_s * 0.35, 2), round(arrival_s * 0.65, 2)) if glances else None,
    )
    carried = _carried(dice, walk, arrival_s) if carries and plan.plot == "through" else []
    return [walk, *carried], arrival_s + TURN_S + abs(turn) / TURN_DEG_PER_S + settle_s


def _carried(dice: Dice, walk: Walk, arrival_s: float) -> list[Action]:
    carry = draw_quiet(dice, walk.start_s)
    return [carry.model_copy(update={"gesture": "carry", "hold_s": round(max(arrival_s - 1.2, 0.5), 2)})]


def _end_s(row: Sequence[Action]) -> float:
    """When the last of these ends; walks do not know."""
    return max([action.end_s for action in row if not isinstance(action, Walk)], default=0.0)
