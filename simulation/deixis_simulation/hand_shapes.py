"""Shapes of a hand: how far its fingers are bent, and the turns of their bones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .avatars import BONE_PREFIX
from .body import FINGERS, Body
from .geometry import Floats
from .rotations import about, across, cross, unit
from .scene import ArmSide

_PALM: Floats = np.array([0.0, -1.0, 0.0])
_SPREAD = (1.0, 0.2, -0.6, -1.3)


@dataclass(frozen=True)
class HandShape:
    """Degrees. bend (4, 3): index, middle, ring, little finger; base, middle, last joint. thumb: opposition, middle, last."""

    bend: Floats
    thumb: Floats
    spread: float


def _shape(index: tuple, middle: tuple, ring: tuple, little: tuple, thumb: tuple, spread: float = 0.0) -> HandShape:
    return HandShape(np.array([index, middle, ring, little], float), np.array(thumb, float), spread)


REST = _shape((14, 18, 8), (20, 24, 12), (24, 28, 14), (26, 30, 16), (4, 4, 8))
INDEX = _shape((2, 4, 2), (72, 98, 60), (80, 100, 62), (84, 98, 60), (42, 30, 48))
OPEN = _shape((-4, 2, 0), (-4, 2, 0), (-4, 3, 0), (-4, 4, 0), (-14, -6, 0), 9)
FLAT = _shape((0, 5, 2), (2, 5, 2), (2, 6, 3), (2, 8, 3), (10, 6, 8), 1)
CLAW = _shape((20, 45, 25), (22, 48, 25), (24, 48, 28), (26, 45, 28), (15, 15, 25), 6)
FIST = _shape((75, 98, 60), (76, 98, 60), (80, 100, 62), (84, 98, 60), (44, 32, 45))
THUMB_UP = _shape((75, 98, 60), (76, 98, 60), (80, 100, 62), (84, 98, 60), (-20, -8, -8))
GRIP = _shape((38, 42, 20), (40, 46, 24), (42, 48, 26), (44, 48, 28), (34, 14, 16))
PINCH = _shape((48, 36, 14), (40, 34, 18), (34, 30, 16), (30, 28, 16), (36, 16, 18))


def mix_shapes(start: HandShape, end: HandShape, share: float) -> HandShape:
    """The shape at `share` of the way."""
    rest = 1 - share
    return HandShape(
        rest * start.bend + share * end.bend, rest * start.thumb + share * end.thumb, rest * start.spread + share * end.spread
    )


def palm_direction(body: Body, side: ArmSide) -> Floats:
    """Where the palm looks (3,) in the T-pose, perpendicular to the hand's direction."""
    return across(_PALM, body.direction(f"{BONE_PREFIX[side]}Hand"))


def finger_rotations(body: Body, side: ArmSide, hand: Floats, shape: HandShape) -> dict[str, Floats]:
    """Turns (3, 3) from the T-pose of all bones of fingers and thumb, when the hand's is `hand`."""
    prefix = BONE_PREFIX[side]
    along = unit(body.direction(f"{prefix}HandMiddle1") + body.direction(f"{prefix}HandMiddle2"))
    palm = across(_PALM, along)
    axis = cross(along, palm)
    inward = 1.0 if side == "right" else -1.0
    found = _thumb(body, prefix, hand, shape, along, palm)
    for finger, bends, spread in zip(FINGERS, shape.bend, _SPREAD, strict=True):
        bone = hand @ about(palm, -shape.spread * spread * inward)
        for number, bend in enumerate(bends, 1):
            bone = bone @ about(axis, bend)
            found[f"{prefix}Hand{finger}{number}"] = bone
    return found


def _thumb(body: Body, prefix: str, hand: Floats, shape: HandShape, along: Floats, palm: Floats) -> dict[str, Floats]:
    """Opposition brings the thumb to the palm, half beneath the middle finger; its ends bend toward the ring finger."""
    opposition, middle, last = shape.thumb
    first = body.direction(f"{prefix}HandThumb1")
    under = body.joint(f"{prefix}HandMiddle1") + palm * 0.03 * body.scale - along * 0.01
    toward = unit(under - body.joint(f"{prefix}HandThumb2"))
    bone = hand @ about(cross(first, palm), opposition * 0.45) @ about(cross(first, toward), opposition * 0.45)
    found = {f"{prefix}HandThumb1": bone}
    ring = unit(body.joint(f"{prefix}HandRing1") + palm * 0.03 * body.scale - body.joint(f"{prefix}HandThumb3"))
    axis = cross(body.direction(f"{prefix}HandThumb2"), ring)
    for number, bend in ((2, middle), (3, last)):
        bone = bone @ about(axis, bend)
        found[f"{prefix}HandThumb{number}"] = bone
    return found
