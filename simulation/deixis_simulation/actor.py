"""An actor: one person of a scene over time. The same scene, person and time give the same moment, in any order of calls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .avatars import BONE_PREFIX, load_avatar
from .body import fit_body
from .envelope import Phase, envelope_of
from .gait import Stance, Way, walk
from .geometry import Floats, robot_at, smooth_step, to_world, view_at
from .gestures import TWO_HANDED
from .head_turn import HeadTurnPlan, plan_head_turn
from .idle import Idle
from .pointing import PointingPlan, fingertip, plan_pointing
from .quiet import QuietPlan, plan_quiet
from .rotations import UP, about, azimuth_deg
from .scene import ArmSide, HeadTurn, Person, Pointing, Quiet, QuietGesture, Scene, Walk
from .skeleton import SIDES, Posture, Skeleton, solve
from .skinning import Mesh, skin
from .trunk import Look, enough_trunk_deg

Gesture = Literal["none", "point", "headturn", "walk"] | QuietGesture
_STREAM = 0x9E0  # keeps the people's random numbers apart from those of other parts of the scene
_GLANCE_S = 0.4


@dataclass(frozen=True, eq=False)
class Moment:
    """A person at a time; world frame, metres.

    phase: of a pointing; nonpoint_phase: of a quiet gesture. poi, arm_side: while there is a phase; gestures of both arms have
    none. head_rotation (3, 3): world from a head that faces +Z. head_centre,
    eyes (3,). shoulder ... fingertip: (3,) per side. place (3,): on the floor; azimuth_deg: where the body faces, from +Z
    toward +X.
    """

    time_s: float
    gesture: Gesture
    phase: Phase
    nonpoint_phase: Phase
    poi: str | None
    arm_side: ArmSide | None
    place: Floats
    azimuth_deg: float
    skeleton: Skeleton
    morphs: dict[str, float]
    head_rotation: Floats
    head_centre: Floats
    eyes: Floats
    shoulder: dict[ArmSide, Floats]
    elbow: dict[ArmSide, Floats]
    wrist: dict[ArmSide, Floats]
    index_base: dict[ArmSide, Floats]
    fingertip: dict[ArmSide, Floats]


@dataclass
class _Signs:
    """What a moment is labelled as."""

    gesture: Gesture = "none"
    phase: Phase = "none"
    nonpoint_phase: Phase = "none"
    poi: str | None = None
    arm_side: ArmSide | None = None


class Actor:
    """The person `number` of a scene. Raises AvatarError if its avatar does not exist."""

    def __init__(self, person: Person, scene: Scene, number: int) -> None:
        self.person = person
        self.avatar = load_avatar(person.avatar)
        self.body = fit_body(self.avatar, person.height_m)
        self._scene = scene
        self._way = Way(person, scene, self.body)
        self._idle = Idle(person, self.body, np.random.default_rng([scene.seed, _STREAM, number]))
        self._plans = [
            self._plan(action, np.random.default_rng([scene.seed, _STREAM, number, row + 1]))
            for row, action in enumerate(person.actions)
            if not isinstance(action, Walk)
        ]

    @property
    def walk_ends_s(self) -> tuple[float, ...]:
        """When the person stands again after each of its walks."""
        return tuple(plan.end_s for plan in self._way.plans)

    def moment(self, time_s: float) -> Moment:
        """The person at a time."""
        stance, signs = self._way.at(time_s), _Signs()
        posture = self._standing_or_walking(time_s, stance)
        if stance.moves:
            signs.gesture = "walk"
        for plan in self._plans:
            if isinstance(plan, HeadTurnPlan):
                plan.apply(posture, time_s)
            else:
                plan.apply(posture, time_s, self._idle)
            _sign(signs, plan, time_s)
        facing = about(UP, stance.azimuth_deg)
        skeleton = solve(self.body, posture).moved(facing, stance.place)
        return _moment(time_s, stance, posture, skeleton, signs)

    def mesh(self, moment: Moment) -> Mesh:
        """Vertices and normals of a moment, world."""
        return skin(moment.skeleton, moment.morphs)

    def _standing_or_walking(self, time_s: float, stance: Stance) -> Posture:
        posture = self._idle.posture(time_s)
        if stance.moves:
            walk(posture, self.body, stance)
        for action in self.person.actions:
            if isinstance(action, Walk) and action.glance_s:
                self._glance(posture, stance, time_s, action.glance_s)
        return posture

    def _glance(self, posture: Posture, stance: Stance, time_s: float, span_s: tuple[float, float]) -> None:
        """Look at the robot between two times."""
        begin, end = span_s
        share = smooth_step((time_s - begin) / _GLANCE_S) * (1 - smooth_step((time_s - end) / _GLANCE_S))
        if share > 0:
            azimuth = self._camera_azimuth(stance, time_s)
            posture.turn_trunk(enough_trunk_deg(0.0, azimuth) * share, 0.0)
            Look((azimuth, 0.0, 0.0), (0.0, 0.0)).mix_into(posture, share)

    def _plan(self, action: Pointing | Quiet | HeadTurn, dice: np.random.Generator) -> PointingPlan | QuietPlan | HeadTurnPlan:
        if isinstance(action, Quiet):
            return plan_quiet(action, self.body, dice)
        middle = envelope_of(action).middle_s
        stance = self._way.at(middle)
        if isinstance(action, HeadTurn):
            return plan_head_turn(action, self._camera_azimuth(stance, middle))
        poi = next(poi for poi in self._scene.pois if poi.poi_id == action.poi)
        target = _in_person(stance, to_world(poi.position_m))
        posture = self._idle.posture(action.start_s)
        return plan_pointing(action, self.body, posture, target, _in_person(stance, self._camera(middle)), dice)

    def _camera(self, time_s: float) -> Floats:
        return view_at(self._scene.camera, robot_at(self._scene.robot_path, time_s)).centre

    def _camera_azimuth(self, stance: Stance, time_s: float) -> float:
        return azimuth_deg(_in_person(stance, self._camera(time_s)))


def _in_person(stance: Stance, world: Floats) -> Floats:
    return about(UP, -stance.azimuth_deg) @ (world - stance.place)


def _sign(signs: _Signs, plan: PointingPlan | QuietPlan | HeadTurnPlan, time_s: float) -> None:
    phase = envelope_of(plan.action).phase(time_s)
    if phase == "none":
        return
    if isinstance(plan, HeadTurnPlan):
        # A gesture of the arm says more than the look that goes with it.
        signs.gesture = "headturn" if signs.gesture in ("none", "walk") else signs.gesture
    elif isinstance(plan, PointingPlan):
        signs.gesture, signs.phase, signs.poi, signs.arm_side = "point", phase, plan.action.poi, plan.action.arm
    elif signs.gesture != "point":
        signs.gesture, signs.nonpoint_phase = plan.action.gesture, phase
        signs.arm_side = None if plan.action.gesture in TWO_HANDED else plan.action.arm


def _moment(time_s: float, stance: Stance, posture: Posture, skeleton: Skeleton, signs: _Signs) -> Moment:
    def of_bone(name: str) -> dict[ArmSide, Floats]:
        return {side: skeleton.position(BONE_PREFIX[side] + name) for side in SIDES}

    body = skeleton.body
    return Moment(
        time_s=time_s,
        gesture=signs.gesture,
        phase=signs.phase,
        nonpoint_phase=signs.nonpoint_phase,
        poi=signs.poi,
        arm_side=signs.arm_side,
        place=stance.place,
        azimuth_deg=stance.azimuth_deg,
        skeleton=skeleton,
        morphs=posture.morphs,
        head_rotation=skeleton.rotation("Head"),
        head_centre=skeleton.carried("Head", body.head_centre),
        eyes=skeleton.carried("Head", body.eyes),
        shoulder=of_bone("Arm"),
        elbow=of_bone("ForeArm"),
        wrist=of_bone("Hand"),
        index_base=of_bone("HandIndex1"),
        fingertip={side: fingertip(skeleton, side) for side in SIDES},
    )
