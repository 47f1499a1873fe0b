"""Who is in the scene: avatars, heights, tints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .dice import Dice
from .scene import Degree

CHILD_SHARE = 0.3
Factors = tuple[float, float, float]


@dataclass(frozen=True)
class Body:
    """What of a person does not depend on what it does."""

    avatar: str
    height_m: float
    skin_tint: Factors
    clothes_tint: Factors
    hair_tint: Factors
    head_deg: tuple[Degree, Degree, Degree]
    restlessness: float


def draw_bodies(dice: Dice, avatars: Sequence[str], count: int, child_share: float = CHILD_SHARE) -> list[Body]:
    """So many different people out of these avatars."""
    return [_draw_body(dice, avatar, child_share) for avatar in dice.shuffled(avatars)[:count]]


def _draw_body(dice: Dice, avatar: str, child_share: float) -> Body:
    child = dice.chance(child_share)
    skin, warmth = dice.between(0.72, 1.2), dice.between(-0.06, 0.06)
    cloth = dice.between_log(0.35, 1.4)
    hair = dice.between_log(0.5, 1.8)
    return Body(
        avatar=avatar,
        height_m=dice.between(1.2, 1.5) if child else dice.between(1.5, 2.0),
        skin_tint=(round(skin * (1 + warmth), 3), skin, round(skin * (1 - warmth), 3)),
        clothes_tint=_about(dice, cloth, 0.3),
        hair_tint=(round(hair * dice.between(0.9, 1.25), 3), hair, round(hair * dice.between(0.75, 1.0), 3)),
        head_deg=(dice.near(0, 3, -8, 8, 1), dice.near(-2, 4, -12, 8, 1), dice.near(0, 2.5, -8, 8, 1)),
        restlessness=dice.between(0.4, 1.8, 2),
    )


def _about(dice: Dice, factor: float, spread: float) -> Factors:
    red, green, blue = (round(factor * dice.between(1 - spread, 1 + spread), 3) for _ in range(3))
    return red, green, blue
