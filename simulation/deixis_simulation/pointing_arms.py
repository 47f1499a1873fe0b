"""Where fingertips are when people point: arms of any person, any style and any direction, without a picture.

To fit what a camera can tell of a pointing's direction. Directions are drawn evenly all around, so that how often a fingertip
is somewhere says how likely the direction makes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M

from .actor import Actor, Moment
from .avatars import BONE_PREFIX
from .bearings import heading_to, place_at
from .dice import Dice
from .draw_actions import SHORTEST_HOLD_S, Target, draw_pointing
from .draw_bodies import draw_bodies
from .draw_stand import draw_front
from .envelope import envelope_of
from .geometry import Floats, robot_at, to_world, view_at, wrap_deg
from .rotations import UP, unit
from .scene import ArmSide, Camera, Person, Scene, ScenePoi

CAMERA_HEIGHT_M = (0.9, 1.5)
DISTANCE_M = (1.1, 3.5)
FIST_SHARE = 0.75
"""Of the way from the wrist to the knuckles; the fingers are bent before the palm."""
POI_DISTANCE_M, POI_HEIGHT_M = (0.8, 4.0), (0.3, 2.3)


@dataclass(frozen=True)
class PointingArm:
    """A pointing that stands. bearing_deg: of the POI at the head, from the direction to the camera, positive toward the
    person's left; elevation_deg: of the POI, above the head; tip, fist (3,): of the index finger and the middle of the fist,
    from the head's middle, in widths of the person's own face: toward the image's right, up, and level toward the camera.
    """

    bearing_deg: float
    elevation_deg: float
    side: ArmSide
    tip: Floats
    fist: Floats


def pointing_arms(seed: int, avatars: Sequence[str], count: int) -> Iterator[PointingArm]:
    """So many of them; the same for the same arguments."""
    rng = np.random.default_rng(seed)
    made = 0
    while made < count:
        arm = _draw(rng, avatars, seed + made)
        if arm is not None:
            made += 1
            yield arm


def _draw(rng: np.random.Generator, avatars: Sequence[str], seed: int) -> PointingArm | None:
    """One, or none where no arm gets there."""
    dice = Dice(rng)
    place = place_at((0.0, 0.0), 0.0, float(rng.uniform(*DISTANCE_M)))
    to_camera = heading_to(place, (0.0, 0.0))
    bearing, front = float(rng.uniform(-180, 180)), draw_front(dice)
    target = Target("P", wrap_deg(bearing - front))
    if not target.reachable():
        return None
    # A third of POIs is near: pictures beside the person, objects on a table.
    away = float(np.exp(rng.uniform(*np.log(POI_DISTANCE_M))))
    x, y = place_at(place, to_camera + bearing, away)
    body = draw_bodies(dice, avatars, 1)[0]
    action = draw_pointing(dice, 0.0, target, SHORTEST_HOLD_S)
    person = Person(
        avatar=body.avatar, height_m=body.height_m, place_m=place, heading_deg=wrap_deg(to_camera + front),
        head_deg=body.head_deg, restlessness=body.restlessness, actions=[action],
    )  # fmt: skip
    camera = Camera(position_m=(0.0, 0.0, float(rng.uniform(*CAMERA_HEIGHT_M))))
    poi = ScenePoi(poi_id="P", position_m=(x, y, float(rng.uniform(*POI_HEIGHT_M))))
    scene = Scene(duration_s=10, camera=camera, pois=[poi], people=[person], seed=seed)
    return _seen(Actor(person, scene, 0), action.arm, envelope_of(action).middle_s, scene)


def _seen(actor: Actor, side: ArmSide, time_s: float, scene: Scene) -> PointingArm:
    moment = actor.moment(time_s)
    head, camera = moment.head_centre, view_at(scene.camera, robot_at(scene.robot_path, time_s)).centre
    poi = to_world(scene.pois[0].position_m) - head
    toward = unit((camera - head) * np.array([1.0, 0.0, 1.0]))
    # Whoever faces the camera has the left hand at the image's right.
    right = np.cross(UP, toward)
    bearing = float(np.degrees(np.arctan2(poi @ right, poi @ toward)))
    level = float(np.hypot(poi @ right, poi @ toward))
    axes = np.stack([right, UP, toward])
    face_width = FACE_WIDTH_M * actor.body.head_scale
    tip, fist = (axes @ (place - head) / face_width for place in (moment.fingertip[side], _fist(moment, side)))
    return PointingArm(bearing, float(np.degrees(np.arctan2(poi @ UP, level))), side, tip, fist)


def _fist(moment: Moment, side: ArmSide) -> Floats:
    """Middle of the fist."""
    knuckle = moment.skeleton.position(f"{BONE_PREFIX[side]}HandMiddle1")
    return np.asarray(moment.wrist[side] + FIST_SHARE * (knuckle - moment.wrist[side]))
