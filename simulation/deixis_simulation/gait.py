"""Where a person stands or walks over time, and how legs and arms go with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .arms import Arm, arm_from_directions, mix_arms, outward
from .body import Body
from .geometry import Floats, robot_at, smooth_step, to_world, world_turn_deg, wrap_deg
from .hand_shapes import REST
from .rotations import azimuth_deg
from .scene import ArmSide, Person, Scene, Walk
from .skeleton import SIDES, Leg, Posture

_RAMP_S = 0.4
_TURNED_AFTER_S = 0.1
"""The last turn ends that long after the last step: who comes to point does not stop before it turns."""
_TURN_BASE_S, _TURN_DEG_PER_S = 0.2, 260.0
_DEG_PER_STEP = 60.0
_STRIDE_OF_LEG = 1.43
"""Stride (two steps) at 1.1 m/s, in lengths of the leg; it grows with the root of the speed."""


@dataclass(frozen=True)
class Stance:
    """Where a person is: place (3,) on the floor of the world, azimuth of the body about Y from +Z toward +X.

    stride_rad: progress of the steps; stride_m: length of two steps; swing, lift: 0 to 1, how much the legs swing and lift.
    """

    place: Floats
    azimuth_deg: float
    stride_rad: float = 0.0
    stride_m: float = 0.0
    swing: float = 0.0
    lift: float = 0.0
    moves: bool = False


@dataclass(frozen=True)
class WalkPlan:
    """One walk: the person turns, goes straight on, turns again at its end. Places (3,) in the world."""

    start_s: float
    start: Floats
    end: Floats
    speed_m_s: float
    stride_m: float
    azimuths_deg: tuple[float, float, float]

    @property
    def distance_m(self) -> float:
        """Length of the way."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def _ramp_s(self) -> float:
        return min(_RAMP_S, self.distance_m / self.speed_m_s)

    @property
    def _times_s(self) -> tuple[float, float, float]:
        """Durations of first turn, way, last turn."""
        before, along, after = self.azimuths_deg
        return _turn_s(along - before), self.distance_m / self.speed_m_s + self._ramp_s, _turn_s(after - along)

    @property
    def end_s(self) -> float:
        """When the person stands again."""
        first, way, last = self._times_s
        return self.start_s + first + max(way + _TURNED_AFTER_S, last)

    def at(self, time_s: float) -> Stance:
        """The stance at a time between start and end."""
        first, way, last = self._times_s
        since = time_s - self.start_s
        if since < first:
            return self._turning(self.start, self.azimuths_deg[0], self.azimuths_deg[1], since / first)
        going = self._going(min(since - first, way), way)
        share = min(max(1 - (self.end_s - time_s) / last, 0.0), 1.0)
        turning = self._turning(self.end, self.azimuths_deg[1], self.azimuths_deg[2], share)
        return replace(
            going,
            azimuth_deg=turning.azimuth_deg,
            stride_rad=going.stride_rad + turning.stride_rad,
            lift=max(going.lift, turning.lift),
        )

    def _going(self, since_s: float, way_s: float) -> Stance:
        ramp = max(self._ramp_s, 1e-9)
        back_s = way_s - since_s
        if since_s < ramp:
            done = self.speed_m_s * since_s**2 / (2 * ramp)
        elif back_s < ramp:
            done = self.distance_m - self.speed_m_s * back_s**2 / (2 * ramp)
        else:
            done = self.speed_m_s * (since_s - ramp / 2)
        effort = smooth_step(min(since_s, back_s) / (0.7 * ramp))
        place = self.start + (self.end - self.start) * (done / max(self.distance_m, 1e-9))
        return Stance(
            place, self.azimuths_deg[1], 2 * math.pi * done / self.stride_m, self.stride_m, effort, effort, moves=True
        )

    def _turning(self, place: Floats, before: float, after: float, share: float) -> Stance:
        turned = (after - before) * smooth_step(share)
        steps = max(1, round(abs(after - before) / _DEG_PER_STEP))
        lift = min(abs(after - before) / _DEG_PER_STEP, 0.6) * math.sin(math.pi * share)
        return Stance(place, before + turned, math.pi * steps * share, self.stride_m, 0.0, lift, moves=True)


class Way:
    """A person's place over time: it stands, and walks as its actions say."""

    def __init__(self, person: Person, scene: Scene, body: Body) -> None:
        self._start = Stance(to_world(person.place_m), world_turn_deg(person.heading_deg))
        self.plans: tuple[WalkPlan, ...] = tuple(_plan(person, scene, body, self._start))

    def at(self, time_s: float) -> Stance:
        """The stance at a time."""
        begun = [plan for plan in self.plans if plan.start_s <= time_s]
        if not begun:
            return self._start
        plan = begun[-1]
        return plan.at(time_s) if time_s < plan.end_s else Stance(plan.end, plan.azimuths_deg[2])


def leg_length(body: Body) -> float:
    """From hip to floor, metres."""
    return float(body.joint("RightUpLeg")[1])


def walk(posture: Posture, body: Body, stance: Stance) -> None:
    """Put the steps of a stance into a posture: legs, hips, arms."""
    phase = stance.stride_rad
    legs: dict[ArmSide, Leg] = {
        "right": _leg(body, stance, phase),
        "left": _leg(body, stance, phase + math.pi),
    }
    posture.legs = legs
    rise = max(_foot_reach(body, leg) for leg in legs.values())
    posture.offset = posture.offset + np.array([0.0, rise - leg_length(body), 0.0])
    sway = stance.swing * math.sin(phase)
    posture.hips = (posture.hips[0] - 6 * sway, posture.hips[1] + 2 * stance.swing, posture.hips[2] + 2.5 * sway)
    posture.spine = (posture.spine[0] + 10 * sway, posture.spine[1], posture.spine[2])
    for side in SIDES:
        swinging = _swinging_arm(body, side, phase + (math.pi if side == "right" else 0.0), stance.swing)
        posture.arms[side] = mix_arms(posture.arms[side], swinging, stance.swing)


def _swing_deg(body: Body, stride_m: float) -> float:
    return math.degrees(math.asin(min(stride_m / (4 * leg_length(body)), 0.6)))


def _leg(body: Body, stance: Stance, phase: float) -> Leg:
    ahead = math.sin(phase)
    lifted = max(0.0, math.cos(phase + 0.35)) ** 2
    thigh = (_swing_deg(body, stance.stride_m) * ahead + 3) * stance.swing + 14 * lifted * max(stance.lift - stance.swing, 0.0)
    return Leg(thigh, 8 * stance.swing + 48 * lifted * stance.lift, (4 + 6 * ahead) * stance.swing)


def _foot_reach(body: Body, leg: Leg) -> float:
    """How far below the hip the lowest point of heel and ball is."""
    shank_deg = leg.swing_deg - leg.knee_deg
    foot = math.radians(leg.foot_up_deg)
    ankle = body.length("RightUpLeg") * math.cos(math.radians(leg.swing_deg)) + body.length("RightLeg") * math.cos(
        math.radians(shank_deg)
    )
    height = float(body.joint("RightFoot")[1])
    ball = float(body.joint("RightToeBase")[2] - body.joint("RightFoot")[2])
    heel = -0.08 * body.scale
    # A foot that is turned up by `foot` has its ball higher and its heel lower.
    return ankle + max(height * math.cos(foot) - along * math.sin(foot) for along in (ball, heel))


def _swinging_arm(body: Body, side: ArmSide, phase: float, swing: float) -> Arm:
    sign = outward(side)
    angle = math.radians(20 * swing * math.sin(phase))
    bent = angle * 1.3 + 0.28
    fore = (sign * 0.03, -math.cos(bent), math.sin(bent))
    hand = (fore[0], fore[1] - 0.1, fore[2])
    upper = (sign * 0.15, -math.cos(angle), math.sin(angle) - 0.04)
    return arm_from_directions(body, side, np.eye(3), upper, fore, hand, REST, palm=(-sign, 0.0, -0.3))


def _turn_s(turn_deg: float) -> float:
    return _TURN_BASE_S + abs(turn_deg) / _TURN_DEG_PER_S if abs(turn_deg) > 1 else 1e-6


def _plan(person: Person, scene: Scene, body: Body, start: Stance) -> Sequence[WalkPlan]:
    """Walks one after the other; one that would begin during the one before begins at its end."""
    plans: list[WalkPlan] = []
    place, azimuth, free_s = start.place, start.azimuth_deg, 0.0
    for action in sorted((a for a in person.actions if isinstance(a, Walk)), key=lambda walk: walk.start_s):
        end = to_world(action.to_m)
        along = azimuth + wrap_deg(azimuth_deg(end - place) - azimuth) if np.linalg.norm(end - place) > 0.01 else azimuth
        stride = _STRIDE_OF_LEG * leg_length(body) * math.sqrt(action.speed_m_s / 1.1)
        begin = max(action.start_s, free_s)
        last = _last_azimuth(action, scene, end, begin + float(np.linalg.norm(end - place)) / action.speed_m_s)
        plan = WalkPlan(begin, place, end, action.speed_m_s, stride, (azimuth, along, along + wrap_deg(last - along)))
        plans.append(plan)
        place, azimuth, free_s = end, plan.azimuths_deg[2], plan.end_s
    return plans


def _last_azimuth(action: Walk, scene: Scene, place: Floats, time_s: float) -> float:
    if action.heading_deg is not None:
        return world_turn_deg(action.heading_deg)
    robot = robot_at(scene.robot_path, time_s)
    return azimuth_deg(to_world((robot.x_m, robot.y_m)) - place)
