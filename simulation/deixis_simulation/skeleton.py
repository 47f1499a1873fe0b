"""Forward kinematics: from a posture (angles of the joints) to the turns and places of all bones."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .arms import Arm, outward
from .avatars import BONE_PREFIX
from .body import Body
from .geometry import Floats
from .hand_shapes import finger_rotations
from .rotations import AHEAD, RIGHT, UP, about, swing, turn
from .scene import ArmSide

SIDES: tuple[ArmSide, ...] = ("right", "left")
_SPINE_SHARE = {"Spine": 0.25, "Spine1": 0.6, "Spine2": 1.0}
_LEGS_FOLLOW_HIPS = 0.5
_TOES_BEND_DEG = 35.0
"""Toes lie on the floor until the heel is that far up."""


@dataclass(frozen=True)
class Leg:
    """Degrees: thigh ahead, knee bent, foot lifted at the ankle (negative: toes down)."""

    swing_deg: float = 0.0
    knee_deg: float = 0.0
    ankle_deg: float = 0.0

    @property
    def foot_up_deg(self) -> float:
        """Pitch of the foot against the floor; negative: the heel is up."""
        return self.swing_deg - self.knee_deg + self.ankle_deg


@dataclass
class Posture:
    """Angles in degrees in the frame of the person (+Z ahead, yaw positive toward its left). Spine: relative to the hips.

    head: yaw, pitch up, roll; not relative to the trunk. gaze: yaw and pitch up of the eyes in the head. offset (3,): of the
    hips, metres; the feet stay unless `legs` says how they go. morphs: share of each morph of the face.
    """

    arms: dict[ArmSide, Arm]
    offset: Floats = field(default_factory=lambda: np.zeros(3))
    hips: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spine: tuple[float, float, float] = (0.0, 0.0, 0.0)
    head: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gaze: tuple[float, float] = (0.0, 0.0)
    legs: dict[ArmSide, Leg] | None = None
    morphs: dict[str, float] = field(default_factory=dict)

    def turn_trunk(self, yaw_deg: float, hips_share: float = 0.35) -> None:
        """Turn the chest further; the hips do their share of it."""
        self.hips = (self.hips[0] + yaw_deg * hips_share, *self.hips[1:])
        self.spine = (self.spine[0] + yaw_deg * (1 - hips_share), *self.spine[1:])

    @property
    def trunk_yaw_deg(self) -> float:
        """Where the chest looks."""
        return self.hips[0] + self.spine[0]

    @property
    def hips_turn(self) -> Floats:
        """Turn (3, 3) of the hips: yaw, pitch down, roll."""
        return turn(*self.hips)

    def spine_turn(self, share: float = 1.0) -> Floats:
        """Turn (3, 3) of the spine where it has done that share of its way; 1: the chest."""
        yaw, pitch, roll = self.spine
        return self.hips_turn @ turn(yaw * share, pitch * share, -roll * share)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Turns (bones, 3, 3) from the T-pose and places (bones, 3)."""

    body: Body
    rotations: Floats
    positions: Floats

    def rotation(self, bone: str) -> Floats:
        """Turn of a bone (3, 3)."""
        found: Floats = self.rotations[self.body.avatar.bone_index[bone]]
        return found

    def position(self, bone: str) -> Floats:
        """Where a bone begins (3,)."""
        found: Floats = self.positions[self.body.avatar.bone_index[bone]]
        return found

    def carried(self, bone: str, point: Floats) -> Floats:
        """Where a point (3,) of the T-pose is that moves with a bone."""
        return self.position(bone) + self.rotation(bone) @ (point - self.body.joint(bone))

    def moved(self, rotation: Floats, place: Floats) -> Skeleton:
        """The same turned about the origin, then shifted."""
        return Skeleton(self.body, rotation @ self.rotations, self.positions @ rotation.T + place)


def solve(body: Body, posture: Posture) -> Skeleton:
    """The skeleton in the person's frame."""
    turns = {"Hips": posture.hips_turn, **_spine(posture), **_head(posture)}
    turns.update(_moving_legs(body, posture) if posture.legs else _standing_legs(body, posture))
    for side in SIDES:
        turns.update(_arm(body, side, posture.arms[side], turns["Spine2"]))
    return _place(body, turns, posture.offset)


def _spine(posture: Posture) -> dict[str, Floats]:
    return {bone: posture.spine_turn(share) for bone, share in _SPINE_SHARE.items()}


def _head(posture: Posture) -> dict[str, Floats]:
    yaw, pitch, roll = posture.head
    chest = posture.trunk_yaw_deg
    head = turn(yaw, -pitch, roll)
    eye = head @ turn(posture.gaze[0], -posture.gaze[1])
    # The neck's share is taken of the angles, not on the shortest way: that flips where the head looks behind.
    neck = turn(chest + 0.4 * (yaw - chest), -0.4 * pitch + 0.5 * posture.spine[1], 0.4 * roll)
    return {"Neck": neck, "Head": head, "RightEye": eye, "LeftEye": eye}


def _standing_legs(body: Body, posture: Posture) -> dict[str, Floats]:
    """Legs that lean so that the feet stay where they are while the hips sway."""
    yaw = about(UP, posture.hips[0] * _LEGS_FOLLOW_HIPS)
    lean = _lean(body, posture)
    turns = {}
    for prefix in BONE_PREFIX.values():
        turns.update({f"{prefix}UpLeg": lean @ yaw, f"{prefix}Foot": yaw})
    return turns


def _lean(body: Body, posture: Posture) -> Floats:
    x, _, z = posture.offset
    return swing((0.0, -1.0, 0.0), (-x, -body.joint("RightUpLeg")[1], -z))


def _moving_legs(body: Body, posture: Posture) -> dict[str, Floats]:
    lean = _lean(body, posture)
    turns = {}
    for side, leg in (posture.legs or {}).items():
        thigh = lean @ about(UP, posture.hips[0] * _LEGS_FOLLOW_HIPS) @ about(RIGHT, -leg.swing_deg)
        shank = thigh @ about(RIGHT, leg.knee_deg)
        foot = shank @ about(RIGHT, -leg.ankle_deg)
        toes = foot @ about(RIGHT, -min(max(-leg.foot_up_deg, 0.0), _TOES_BEND_DEG))
        prefix = BONE_PREFIX[side]
        bones = (("UpLeg", thigh), ("Leg", shank), ("Foot", foot), ("ToeBase", toes))
        turns.update({prefix + bone: rotation for bone, rotation in bones})
    return turns


def _arm(body: Body, side: ArmSide, arm: Arm, chest: Floats) -> dict[str, Floats]:
    prefix, sign = BONE_PREFIX[side], outward(side)
    upper = chest @ arm.upper
    fore = upper @ arm.fore
    hand = fore @ arm.hand
    return {
        f"{prefix}Shoulder": chest @ about(AHEAD, sign * arm.clavicle_up_deg) @ about(UP, -sign * arm.clavicle_ahead_deg),
        f"{prefix}Arm": upper,
        f"{prefix}ForeArm": fore,
        f"{prefix}Hand": hand,
        f"{prefix}FingerBase": hand,
        **finger_rotations(body, side, hand, arm.shape),
    }


def _place(body: Body, turns: dict[str, Floats], offset: Floats) -> Skeleton:
    """Bones that are not in `turns` go with their parents."""
    avatar = body.avatar
    rotations = np.tile(np.eye(3), (len(avatar.bones), 1, 1))
    positions = body.joints.copy()
    positions[body.order[0]] += offset
    for row in body.order:
        parent = avatar.parent[row]
        if parent >= 0:
            positions[row] = positions[parent] + rotations[parent] @ (body.joints[row] - body.joints[parent])
        given = turns.get(avatar.bones[row])
        rotations[row] = given if given is not None else rotations[parent]
    return Skeleton(body, rotations, positions)
