"""Which gesture a stroke is, by the number and the posture of the fingertips (paper section 4, [18]).

Every frame of a stroke casts a vote by what it shows of the hand; `paper_stroke.py` counts them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from .fingertips import Finger
from .hand import HandShape

Vote = Literal["point_left", "point_right", "invisible", "other", "unclear"]

# Fingers of an open hand stick out by 0.34 to 0.6 face widths, the thumb beside a pointing finger by less than 0.3.
SPREAD_FINGER = 0.31
POINTING_FINGER = 0.17
LONG_FINGER = 0.4
# An upright palm with closed fingers shows no finger, but is larger than a fist and points up.
UPRIGHT_DEG = 38.0
UPRIGHT_AREA = 0.42
UPRIGHT_REACH = 0.5
UPRIGHT_BELOW_FACE = 1.3
# A finger steeper than 65 degrees points at the ceiling: "wait", "one".
STEEP = 2.14
# An outline wider than this is no single hand (a hand before the face, or a wall of skin colour).
LARGEST_PALM = 0.42
LARGEST_AREA = 1.0
# Without a finger: the arm is stretched sideways this far, or the hand is large since it is held toward the camera.
STRETCHED = 1.45
NEAR_CAMERA_PALM = 0.29
# Without a long finger the hand is at the height of chin to belly, where an arm ends that points ahead or back: a hand beside
# the head is rather raised to greet, and such hands have been torn to fingerless rags by a wall of skin colour.
HEIGHTS_BELOW_FACE = (0.3, 2.2)
# Share of the hand that the largest circle in it fills: 0.4 to 0.65 for fists, below 0.3 for rags.
COMPACT = 0.33
# A long finger on less than this is a shred of background: fists behind long fingers have 0.21 to 0.33.
LEAST_PALM = 0.17
# An arm can hold its tip this far beside the face only if it is stretched sideways, which is a pointing posture whether or
# not a finger stands out of the fist (a wall of skin colour swallows fingers, and tears others out of a fist).
FAR_STRETCHED = 3.2
FAR_STRETCHED_BELOW_FACE = (0.3, 3.2)
# Nearer to the face's centre line than this the side is the finger's direction, not the hand's place.
CENTRAL = 1.0
FINGER_DIRECTION = 0.15


def vote(hand: HandShape, fingers: Sequence[Finger]) -> Vote:
    """What one frame shows of a raised, motionless hand; `fingers` the longest first."""
    if hand.palm_radius > LARGEST_PALM or hand.area > LARGEST_AREA:
        return "unclear"
    spread = sum(finger.length >= SPREAD_FINGER for finger in fingers)
    single = len(fingers) > 0 and fingers[0].length >= LONG_FINGER and spread == 1
    if spread >= 3 or len(fingers) >= 4 or (_is_upright_palm(hand) and not single):
        return "other"
    if _is_stretched_sideways(hand):
        return "point_left" if hand.tip[0] > 0 else "point_right"
    if spread == 2:
        return "other"
    if fingers and _is_believable(fingers[0], hand):
        return _pointing(hand, fingers[0])
    return "invisible" if _is_held_out(hand) else "unclear"


def _is_upright_palm(hand: HandShape) -> bool:
    return (
        hand.elevation_deg >= UPRIGHT_DEG
        and hand.area >= UPRIGHT_AREA
        and hand.reach >= UPRIGHT_REACH
        and hand.centroid[1] <= UPRIGHT_BELOW_FACE
    )


def _is_stretched_sideways(hand: HandShape) -> bool:
    highest, lowest = FAR_STRETCHED_BELOW_FACE
    return abs(hand.tip[0]) >= FAR_STRETCHED and highest <= hand.centroid[1] <= lowest


def _is_believable(finger: Finger, hand: HandShape) -> bool:
    if _is_fist(hand):
        return finger.length >= POINTING_FINGER
    return finger.length >= LONG_FINGER and hand.palm_radius >= LEAST_PALM


def _is_held_out(hand: HandShape) -> bool:
    return _is_fist(hand) and (abs(hand.centroid[0]) >= STRETCHED or hand.palm_radius >= NEAR_CAMERA_PALM)


def _is_fist(hand: HandShape) -> bool:
    """A compact hand at the height of a pointing hand."""
    highest, lowest = HEIGHTS_BELOW_FACE
    return highest <= hand.centroid[1] <= lowest and math.pi * hand.palm_radius**2 >= COMPACT * hand.area


def _pointing(hand: HandShape, finger: Finger) -> Vote:
    dx, dy = finger.tip[0] - hand.palm[0], finger.tip[1] - hand.palm[1]
    if -dy > abs(dx) * STEEP:
        return "other"
    x = finger.tip[0] if abs(hand.palm[0]) >= CENTRAL else dx
    if abs(x) < FINGER_DIRECTION:
        return "invisible" if _is_held_out(hand) else "unclear"
    return "point_left" if x > 0 else "point_right"
