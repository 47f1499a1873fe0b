"""Pointing at a POI: arm, hand, head and trunk over time."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import numpy as np

from .arms import Arm, arm_from_directions, arm_to_wrist, mix_arms, outward
from .avatars import BONE_PREFIX
from .body import Body
from .envelope import envelope_of, shape_share
from .geometry import Floats
from .hand_shapes import FLAT, INDEX
from .idle import Idle
from .rotations import UP, azimuth_deg, elevation_deg, heading_vector, unit
from .scene import ArmSide, Pointing
from .skeleton import Posture, Skeleton, solve
from .trunk import Look, azimuth_of, enough_trunk_deg, reachable_deg, usual_trunk_deg

_HEAD_PITCH_SHARE = 0.55
_HEAD_RELEASE_S = 0.12
"""The head leaves the target that much later than its lag says."""
_ACROSS_DEG = {"straight": 75.0, "bent": 55.0, "hip": 45.0}
_OUT_DEG = {"straight": 125.0, "bent": 100.0, "hip": 85.0}
"""How far an arm points from straight ahead of the chest, across it and outward."""
_SHAPES = {"index": INDEX, "flat": FLAT}
_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class PointingPlan:
    """One pointing, worked out: the arm when it stands, turn of the trunk, where head and eyes go."""

    action: Pointing
    trunk_deg: float
    arm: Arm
    look: Look

    def apply(self, posture: Posture, time_s: float, idle: Idle) -> None:
        """Put the pointing, as far as it is at a time, into a posture."""
        action, envelope = self.action, envelope_of(self.action)
        limb = envelope.share(time_s)
        posture.turn_trunk(self.trunk_deg * envelope.share(time_s))
        lag = action.head_lag_s
        head = envelope.share(time_s, lag, lag + _HEAD_RELEASE_S)
        eyes = envelope.share(time_s, lag - 0.1, lag + _HEAD_RELEASE_S)
        self.look.mix_into(posture, head, max(eyes - head, 0.0))
        held = idle.unsteady(self.arm, action.arm, time_s, 0.45)
        share = shape_share(limb, envelope.phase(time_s))
        posture.arms[action.arm] = mix_arms(posture.arms[action.arm], held, limb, share)


def plan_pointing(
    action: Pointing, body: Body, posture: Posture, target: Floats, camera: Floats, dice: np.random.Generator
) -> PointingPlan:
    """Work out a pointing. `posture`: of the person before it; `target`, `camera`: in the person's frame, metres."""
    posture = copy.copy(posture)
    posture.arms = dict(posture.arms)
    roll, reach = float(dice.uniform(-2, 2)), float(dice.uniform(0.95, 1.0))
    trunk = 0.0
    for _ in range(2):
        # Trunk and head move the place that the angles are measured from; so once more from there.
        middle = solve(body, posture).carried("Head", body.head_centre)
        way = target - middle
        azimuth = azimuth_of(way, outward(action.arm))
        before, trunk = trunk, _trunk_deg(action, azimuth)
        look = _look(action, azimuth, elevation_deg(way), camera - middle, trunk, roll)
        posture.turn_trunk(trunk - before)
        posture.head = look.head
    return PointingPlan(action, trunk, pointing_arm(action, body, posture, target, reach), look)


def pointing_arm(action: Pointing, body: Body, posture: Posture, target: Floats, reach: float) -> Arm:
    """The arm that points at `target` (3,) in that posture. `reach`: share of the arm's length that a straight one uses."""
    if action.style == "straight":
        return _straight_arm(action, body, posture, target, reach)
    return _bent_arm(action, body, posture, target)


def fingertip(skeleton: Skeleton, side: ArmSide) -> Floats:
    """Tip of the index finger (3,)."""
    return skeleton.carried(f"{BONE_PREFIX[side]}HandIndex3", skeleton.body.fingertip[side])


def _straight_arm(action: Pointing, body: Body, posture: Posture, target: Floats, reach: float) -> Arm:
    """The fingertip between the line from the eyes and the line from the shoulder to the target."""
    side, shape, prefix = action.arm, _SHAPES[action.hand], BONE_PREFIX[action.arm]
    chest, skeleton = posture.spine_turn(), solve(body, posture)
    shoulder, eyes = skeleton.position(f"{prefix}Arm"), skeleton.carried("Head", body.eyes)
    finger = float(np.linalg.norm(body.fingertip[side] - body.joint(f"{prefix}Hand")))
    length = (body.length(f"{prefix}Arm") + body.length(f"{prefix}ForeArm")) * reach + finger
    elbow_toward = -UP + chest @ np.array([outward(side) * 0.55, 0.0, -0.25])
    missed = np.zeros(3)
    for _ in range(_ROUNDS):
        # The clavicle brings the shoulder forward, the finger is no straight continuation of the hand: once more from there.
        tip = _tip(shoulder, eyes, target, length)
        hand = unit(0.6 * unit(target - tip) + 0.4 * unit(tip - shoulder))
        wrist = tip - hand * finger + missed
        arm = arm_to_wrist(body, side, chest, shoulder, wrist, elbow_toward, hand, shape, pronation_deg=action.pronation_deg)
        posture.arms[side] = arm
        skeleton = solve(body, posture)
        shoulder = skeleton.position(f"{prefix}Arm")
        missed = missed + _tip(shoulder, eyes, target, length) - fingertip(skeleton, side)
    return arm


def _tip(shoulder: Floats, eyes: Floats, target: Floats, length: float) -> Floats:
    """Half-way between the lines from eyes and shoulder to the target, as far from the shoulder as the arm is long."""
    on_sight = unit(_on_ray(eyes, target, shoulder, length) - shoulder)
    return shoulder + length * unit(on_sight + unit(target - shoulder))


def _bent_arm(action: Pointing, body: Body, posture: Posture, target: Floats) -> Arm:
    """The forearm points at the target; the upper arm is half raised, or beside the body (from the hip)."""
    side, prefix, chest = action.arm, BONE_PREFIX[action.arm], posture.spine_turn()
    sign, shape = outward(side), _SHAPES[action.hand]
    arm = posture.arms[side]
    for _ in range(_ROUNDS):
        shoulder = solve(body, posture).position(f"{prefix}Arm")
        upper = _upper_arm(action, chest, unit((target - shoulder) * np.array([1.0, 0.0, 1.0])), sign)
        fore = target - (shoulder + body.length(f"{prefix}Arm") * upper)
        arm = arm_from_directions(
            body, side, chest, upper, fore, fore, shape, chest @ heading_vector(0), pronation_deg=action.pronation_deg
        )
        posture.arms[side] = arm
    return arm


def _upper_arm(action: Pointing, chest: Floats, level: Floats, sign: float) -> Floats:
    """Of the upper arm, when the forearm goes along `level`: out where that goes outward, ahead where it crosses the belly."""
    sideward = sign * float((chest.T @ level)[0])
    out, across = max(sideward, 0.0), max(-sideward, 0.0)
    side, ahead = chest @ np.array([sign, 0.0, 0.0]), chest @ np.array([0.0, 0.0, 1.0])
    if action.style == "hip":
        return unit(-UP + (0.16 + 0.15 * out) * side + (0.6 * across - 0.12) * ahead + 0.12 * level)
    return unit(-UP + (0.30 + 0.25 * out) * side + (0.15 + 0.45 * across) * ahead + 0.45 * level)


def _on_ray(start: Floats, target: Floats, centre: Floats, radius: float) -> Floats:
    """Where the ray from `start` to `target` leaves a sphere; the nearest point of the ray if it misses it."""
    along, offset = unit(target - start), start - centre
    half = float(offset @ along)
    root = max(half * half - float(offset @ offset) + radius * radius, 0.0)
    leaves: Floats = start + along * (math.sqrt(root) - half)
    return leaves


def _look(action: Pointing, azimuth: float, elevation: float, to_camera: Floats, trunk: float, roll: float) -> Look:
    if action.looks != "poi":
        aside = action.elsewhere_deg if action.looks == "elsewhere" else 0.0
        # People look up or down at a robot; elsewhere there is nothing to look at.
        up = elevation_deg(to_camera) if action.looks == "robot" else 0.0
        pitch = up * _HEAD_PITCH_SHARE
        return Look((reachable_deg(azimuth_deg(to_camera) + aside, trunk), pitch, roll), (0.0, up - pitch))
    head = reachable_deg(_head_deg(action, azimuth), trunk)
    pitch = elevation * _HEAD_PITCH_SHARE
    return Look((head, pitch, roll), (azimuth - head, elevation - pitch))


def _head_deg(action: Pointing, azimuth: float) -> float:
    return azimuth * action.head_gain + float(np.sign(azimuth)) * action.head_overshoot_deg


def _trunk_deg(action: Pointing, azimuth: float) -> float:
    """As people usually do, times the gain; but as much as the arm needs, and the neck if the head looks there."""
    wanted = usual_trunk_deg(azimuth) * action.torso_gain
    across, out = _ACROSS_DEG[action.style], _OUT_DEG[action.style]
    left, right = (out, across) if action.arm == "left" else (across, out)
    enough = min(max(wanted, azimuth - left), azimuth + right)
    return enough_trunk_deg(enough, _head_deg(action, azimuth) if action.looks == "poi" else enough)
