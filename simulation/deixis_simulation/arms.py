"""Arms: two-bone inverse kinematics, and arms from the directions of their bones.

Directions are in the frame of the person (Y up, +Z ahead, +X its left). `trunk` (3, 3) is the turn of the chest there. An arm
is kept relative to the chest, so that it goes along when the trunk turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .avatars import BONE_PREFIX
from .body import Body
from .geometry import Floats
from .hand_shapes import REST, HandShape, mix_shapes, palm_direction
from .rotations import AHEAD, Vector, about, across, angle_about, between, elevation_deg, frame, swing, unit
from .scene import ArmSide

_NEARLY_STRAIGHT, _SURELY_BENT = 0.08, 0.33
_FOREARM_SHARE = 0.55
"""Share of a turn about the arm's axis that the forearm takes; the wrist does the rest."""


@dataclass(frozen=True, eq=False)
class Arm:
    """Turns (3, 3) of the upper arm in the chest, of the forearm in it, of the hand in that; clavicle in degrees."""

    upper: Floats
    fore: Floats
    hand: Floats
    shape: HandShape
    clavicle_up_deg: float = 0.0
    clavicle_ahead_deg: float = 0.0


def outward(side: ArmSide) -> float:
    """Sign of X on that side of the person."""
    return -1.0 if side == "right" else 1.0


def arm_from_directions(
    body: Body,
    side: ArmSide,
    trunk: Floats,
    upper: Vector,
    fore: Vector,
    hand: Vector,
    shape: HandShape,
    bends_toward: Vector = AHEAD,
    pronation_deg: float = 0.0,
    palm: Vector | None = None,
) -> Arm:
    """An arm whose bones point along the given directions.

    `bends_toward`: where the elbow's inner side looks if the arm is nearly straight. `palm`: where the palm looks; without it
    the forearm is turned by `pronation_deg`.
    """
    upper, fore, hand = unit(upper), unit(fore), unit(hand)
    prefix = BONE_PREFIX[side]
    up_turn = frame(upper, _inner_side(upper, fore, bends_toward)) @ frame(body.direction(f"{prefix}Arm"), AHEAD).T
    fore_turn = swing(up_turn @ body.direction(f"{prefix}ForeArm"), fore) @ up_turn
    if palm is None:
        twist = -outward(side) * pronation_deg
        fore_turn = about(fore, twist * _FOREARM_SHARE) @ fore_turn
        hand_turn = about(hand, twist * (1 - _FOREARM_SHARE)) @ _aligned(body, prefix, fore_turn, hand)
    else:
        fore_turn = about(fore, _palm_turn(body, side, fore_turn, hand, palm) * _FOREARM_SHARE) @ fore_turn
        rest = _palm_turn(body, side, fore_turn, hand, palm)
        hand_turn = about(hand, rest) @ _aligned(body, prefix, fore_turn, hand)
    in_chest = trunk.T @ upper
    return Arm(
        trunk.T @ up_turn,
        up_turn.T @ fore_turn,
        fore_turn.T @ hand_turn,
        shape,
        clavicle_up_deg=float(np.interp(elevation_deg(in_chest), [-80, -35, 0, 60], [-7, 0, 5, 16])),
        clavicle_ahead_deg=12 * float(in_chest[2]),
    )


def arm_to_wrist(
    body: Body,
    side: ArmSide,
    trunk: Floats,
    shoulder: Floats,
    wrist: Floats,
    elbow_toward: Vector,
    hand: Vector,
    shape: HandShape,
    pronation_deg: float = 0.0,
    palm: Vector | None = None,
) -> Arm:
    """An arm whose wrist is at a place, or as near as it reaches; the elbow is on the side of `elbow_toward` (two-bone IK)."""
    prefix = BONE_PREFIX[side]
    a, b = body.length(f"{prefix}Arm"), body.length(f"{prefix}ForeArm")
    way = wrist - shoulder
    distance = min(max(float(np.linalg.norm(way)), abs(a - b) + 0.03 + 0.12 * (a + b)), 0.998 * (a + b))
    along = unit(way)
    cosine = (a * a + distance * distance - b * b) / (2 * a * distance)
    aside = across(elbow_toward, along)
    elbow = a * (cosine * along + math.sqrt(max(0.0, 1 - cosine * cosine)) * aside)
    return arm_from_directions(
        body, side, trunk, elbow, distance * along - elbow, hand, shape, -aside, pronation_deg=pronation_deg, palm=palm
    )


def hanging_arm(body: Body, side: ArmSide, out: float = 0.0, ahead: float = 0.0, bend: float = 0.0) -> Arm:
    """The arm at rest beside the body; out, ahead, bend are small deviations (tangents)."""
    sign = outward(side)
    upper, fore = (sign * (0.17 + out), -1.0, ahead - 0.04), (sign * 0.06, -1.0, 0.20 + bend)
    return arm_from_directions(body, side, np.eye(3), upper, fore, (0.0, -1.0, 0.16), REST, pronation_deg=22)


def mix_arms(start: Arm, end: Arm, share: float, shape_share: float | None = None) -> Arm:
    """The arm at `share` of the way from one to the other; its hand may be ahead or behind."""
    rest = 1 - share
    return Arm(
        between(start.upper, end.upper, share),
        between(start.fore, end.fore, share),
        between(start.hand, end.hand, share),
        mix_shapes(start.shape, end.shape, share if shape_share is None else shape_share),
        rest * start.clavicle_up_deg + share * end.clavicle_up_deg,
        rest * start.clavicle_ahead_deg + share * end.clavicle_ahead_deg,
    )


def _inner_side(upper: Floats, fore: Floats, bends_toward: Vector) -> Floats:
    """Where the elbow's inner side looks: toward the forearm, if it is bent enough to tell."""
    bend = fore - upper * float(upper @ fore)
    size = float(np.linalg.norm(bend))
    usual = across(bends_toward, upper)
    share = min(max((size - _NEARLY_STRAIGHT) / (_SURELY_BENT - _NEARLY_STRAIGHT), 0.0), 1.0)
    return unit(share * unit(bend) + (1 - share) * usual) if size > 1e-6 else usual


def _aligned(body: Body, prefix: str, fore_turn: Floats, hand: Floats) -> Floats:
    return swing(fore_turn @ body.direction(f"{prefix}Hand"), hand) @ fore_turn


def _palm_turn(body: Body, side: ArmSide, fore_turn: Floats, hand: Floats, palm: Vector) -> float:
    """Degrees about the hand's direction that bring the palm to where it shall look."""
    looks = _aligned(body, BONE_PREFIX[side], fore_turn, hand) @ palm_direction(body, side)
    return angle_about(hand, looks, across(palm, hand))
