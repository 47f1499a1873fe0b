"""Arms before the face, as a camera sees them that is pointed at or past: rendered, with their shadows.

Painted arms were not enough: with a real forearm and fist across the mouth a face at -14 degrees was read as 45.
"""

from __future__ import annotations

import numpy as np

from .arms import Arm, arm_to_wrist, outward
from .body import Body
from .geometry import Floats
from .hand_shapes import FIST, FLAT, INDEX, OPEN, REST
from .rotations import turn, unit
from .scene import ArmSide
from .skeleton import SIDES

HAND_FROM_HEAD_M = (0.16, 0.5)
"""How far before the head the wrist is."""
AROUND_DEG, UP_DEG = 110.0, (-8.0, 18.0)
"""The wrist's bearing from the head: at most so far around, elevation (mean, deviation)."""
SHAPES = (REST, INDEX, INDEX, OPEN, FLAT, FIST)


def raised_arm(rng: np.random.Generator, body: Body) -> tuple[ArmSide, Arm, Floats]:
    """An arm with its hand somewhere before the head; and azimuth and elevation (2,) of the wrist from the head, degrees."""
    side = SIDES[int(rng.integers(2))]
    # Mostly its own side; across the body as often as people reach there.
    azimuth = outward(side) * float(rng.uniform(-0.6, 1.0)) * AROUND_DEG
    bearing = np.array([azimuth, float(np.clip(rng.normal(*UP_DEG), -45, 35))])
    wrist = body.head_centre + rng.uniform(*HAND_FROM_HEAD_M) * body.head_scale * direction_of(bearing)
    shoulder = body.joint("RightArm" if side == "right" else "LeftArm")
    elbow = (outward(side) * rng.uniform(0.1, 1), -rng.uniform(0.2, 1), rng.normal(0, 0.3))
    hand = unit(unit(wrist - shoulder) + rng.normal(0, 0.5, 3))
    shape = SHAPES[int(rng.integers(len(SHAPES)))]
    arm = arm_to_wrist(body, side, np.eye(3), shoulder, wrist, elbow, hand, shape, pronation_deg=float(rng.uniform(-60, 90)))
    return side, arm, bearing


def direction_of(bearing_deg: Floats) -> Floats:
    """Unit vector (3,) with that azimuth (positive to the person's left) and elevation."""
    direction: Floats = turn(float(bearing_deg[0]), -float(bearing_deg[1])) @ np.array([0.0, 0.0, 1.0])
    return direction
