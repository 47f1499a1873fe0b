"""What a hand that is held shows in one frame: where it is, where it goes on, how large it is, its fingers, its fellow.

Everything is in face widths about the face's middle and mirrored for right hands: `out` is toward the hand's own side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from deixis_schemas.messages import Side

from .fingertips import Finger
from .hand import CHEST, HandShape
from .rules import vote

Point = tuple[float, float]

OPEN_PALM = 0.75
"""Breadth of a hand that shows its open palm, face widths; a fist with its finger is .5 to .6."""


@dataclass(frozen=True)
class HeldHand:
    """palm: out and down from the face's middle; tip: the same from the palm. palm_radius, breadth: of the largest circle in
    it, and of the square as large as it is. fingers: the lengths that stand out, the longest first. fellow: the person's other
    hand, out (on its own side) and down from the face; none where it is not seen. is_open: the paper's
    rules see an open or upright hand.
    """

    palm: Point
    tip: Point
    palm_radius: float
    breadth: float
    fingers: tuple[float, ...]
    fellow: Point | None
    is_open: bool = False

    @property
    def is_open_palm(self) -> bool:
        """An open hand that shows its palm: 2 of a hundred that point look so, 40 and 30 of those that stop or wave."""
        return self.is_open and self.breadth >= OPEN_PALM

    @property
    def reach(self) -> float:
        """From the chest to the palm."""
        return math.dist(self.palm, CHEST)

    @property
    def elevation_deg(self) -> float:
        """Of the way palm -> tip above the horizontal, -90 to 90."""
        return math.degrees(math.atan2(-self.tip[1], abs(self.tip[0])))

    @property
    def bend_deg(self) -> float:
        """From the way chest -> palm to the way palm -> tip: 0 where the hand goes on as the arm does; positive upward."""
        arm = math.atan2(CHEST[1] - self.palm[1], self.palm[0] - CHEST[0])
        hand = math.atan2(-self.tip[1], self.tip[0])
        turned = math.remainder(hand - arm, 2 * math.pi)
        # Of a hand across the body, up is the other way round.
        return math.degrees(turned if self.palm[0] >= CHEST[0] else -turned)


def held_hand(hand: HandShape, fingers: Sequence[Finger], side: Side | None, fellow: Point | None) -> HeldHand:
    """What `hand` shows; `fellow`: place of the other hand, x and y in face widths. A hand of unknown side is taken as one
    that is on its own side.
    """
    left = hand.palm[0] >= 0 if side is None else side == "left"
    sense = 1.0 if left else -1.0
    return HeldHand(
        (sense * hand.palm[0], hand.palm[1]),
        (sense * (hand.tip[0] - hand.palm[0]), hand.tip[1] - hand.palm[1]),
        hand.palm_radius,
        math.sqrt(hand.area),
        tuple(finger.length for finger in fingers),
        None if fellow is None else (-sense * fellow[0], fellow[1]),
        vote(hand, fingers) == "other",
    )
