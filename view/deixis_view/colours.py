"""Colours that can be told apart on dark and on light ground."""

from __future__ import annotations

Colour = tuple[int, int, int]

FACE: Colour = (46, 184, 92)
LEFT_HAND: Colour = (51, 153, 255)
RIGHT_HAND: Colour = (255, 122, 56)
UNKNOWN: Colour = (150, 150, 150)
FINGERTIP: Colour = (255, 214, 0)
ROBOT: Colour = (120, 140, 170)
PERSON: Colour = (46, 184, 92)
WALL: Colour = (120, 120, 130)
NO_BELIEF: Colour = (110, 120, 135)
FULL_BELIEF: Colour = (235, 45, 140)

KINDS = {"face": FACE, "left_hand": LEFT_HAND, "right_hand": RIGHT_HAND, "unknown": UNKNOWN}
HANDS = {"left": LEFT_HAND, "right": RIGHT_HAND}
# Of curves, one after the other.
CURVES: tuple[Colour, ...] = (
    (235, 45, 140), (51, 153, 255), (46, 184, 92), (255, 122, 56), (160, 110, 255),
    (0, 176, 176), (214, 160, 0), (190, 80, 80), (120, 140, 170), (140, 180, 60),
)  # fmt: skip


def of_belief(chance: float) -> Colour:
    """From grey, at 0, to the colour of an answer, at 1."""
    share = min(1.0, max(0.0, chance))
    red, green, blue = (round(low + share * (high - low)) for low, high in zip(NO_BELIEF, FULL_BELIEF, strict=True))
    return red, green, blue
