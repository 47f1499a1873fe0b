"""What people do: each function draws one action, or a row of them, from a start on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .dice import Dice
from .scene import QUIET_GESTURES, Action, ArmSide, HeadTurn, Pointing, Quiet

ARM_REACH_DEG = 118.0
"""How far to the side of the body's front an arm points without a step."""
CROSS_REACH_DEG = 50.0
"""The same with the arm of the other side."""
OTHER_ARM_SHARE = 0.15
LOOKS_AWAY_SHARE = 0.15
HEAD_GAIN = (0.3, 1.05)
SHORTEST_HOLD_S = 0.8
LONGEST_HOLD_S = 2.1
HOLD_IN_A_ROW_S = 1.6
TURN_DEG = (15.0, 130.0)
TURN_REACH_DEG = 135.0
"""How far head and trunk together turn away from the body's front."""


@dataclass(frozen=True)
class Target:
    """A POI as a standing person has it: degrees from the body's front, positive toward the person's own left."""

    poi: str
    off_front_deg: float

    @property
    def reachable(self) -> bool:
        """Whether an arm gets there."""
        return abs(self.off_front_deg) <= ARM_REACH_DEG


def draw_pointing(dice: Dice, start_s: float, target: Target, longest_hold_s: float) -> Pointing:
    """One pointing at this target."""
    looks_away, at_robot = dice.chance(LOOKS_AWAY_SHARE), dice.chance(0.5)
    return Pointing(
        start_s=round(start_s, 2),
        preparation_s=dice.between(0.35, 0.9, 2),
        hold_s=dice.between(SHORTEST_HOLD_S, longest_hold_s, 2),
        retraction_s=dice.between(0.35, 0.9, 2),
        poi=target.poi,
        arm=_draw_arm(dice, target.off_front_deg),
        style=dice.weighed({"straight": 0.55, "bent": 0.3, "hip": 0.15}),
        hand=dice.weighed({"index": 0.8, "flat": 0.2}),
        looks=("robot" if at_robot else "elsewhere") if looks_away else "poi",
        elsewhere_deg=dice.between(-70, 70, 1),
        head_gain=dice.between(*HEAD_GAIN),
        head_lag_s=dice.between(-0.2, 0.3, 2),
        head_overshoot_deg=dice.between(0, 5, 1),
        torso_gain=dice.between(0.5, 1.4, 2),
        pronation_deg=dice.between(0, 90, 0),
    )


def draw_pointings(dice: Dice, start_s: float, targets: Sequence[Target], count: int) -> list[Action]:
    """So many pointings in a row, at different targets; fewer where fewer are in reach."""
    row: list[Action] = []
    for target in dice.shuffled([target for target in targets if target.reachable])[:count]:
        pointing = draw_pointing(dice, start_s, target, LONGEST_HOLD_S if count == 1 else HOLD_IN_A_ROW_S)
        row.append(pointing)
        start_s = pointing.end_s + dice.between(0.25, 0.6, 2)
    return row


def draw_quiet(dice: Dice, start_s: float) -> Quiet:
    """One gesture that is no pointing."""
    return Quiet(
        gesture=dice.one(QUIET_GESTURES),
        start_s=round(start_s, 2),
        preparation_s=dice.between(0.35, 0.8, 2),
        hold_s=dice.between(0.9, 2.6, 2),
        retraction_s=dice.between(0.35, 0.8, 2),
        arm=dice.weighed({"right": 0.6, "left": 0.4}),
        rate_hz=dice.between(1.2, 3.2, 2),
    )


def draw_quiets(dice: Dice, start_s: float, until_s: float, count: int) -> list[Action]:
    """So many quiet gestures in a row, as far as they end in time."""
    row: list[Action] = []
    for _ in range(count):
        gesture = draw_quiet(dice, start_s)
        if gesture.end_s > until_s and row:
            break
        row.append(gesture)
        start_s = gesture.end_s + dice.between(0.15, 0.6, 2)
    return row


def draw_turn(dice: Dice, start_s: float, front_deg: float) -> HeadTurn:
    """A look to a side. `front_deg`: azimuth of the body's front; the neck does not go farther than TURN_REACH_DEG from it."""
    size, side = dice.between(*TURN_DEG, 1), dice.one((-1, 1))
    azimuth = min(max(side * size, front_deg - TURN_REACH_DEG), front_deg + TURN_REACH_DEG)
    return HeadTurn(
        start_s=round(start_s, 2),
        azimuth_deg=round(azimuth, 1),
        pitch_deg=dice.near(0, 8, -25, 25, 1),
        turn_s=dice.between(0.35, 0.9, 2),
        hold_s=dice.between(0.3, 1.5, 2),
        torso_gain=dice.between(0.1, 1.0, 2),
    )


def draw_turns(dice: Dice, start_s: float, until_s: float, front_deg: float, count: int) -> list[Action]:
    """So many looks in a row, as far as they end in time."""
    row: list[Action] = []
    for _ in range(count):
        turn = draw_turn(dice, start_s, front_deg)
        if turn.end_s > until_s and row:
            break
        row.append(turn)
        start_s = turn.end_s + dice.between(0.1, 0.6, 2)
    return row


def _draw_arm(dice: Dice, off_front_deg: float) -> ArmSide:
    """Usually the arm of the side that is pointed to."""
    other = dice.chance(OTHER_ARM_SHARE) and abs(off_front_deg) <= CROSS_REACH_DEG
    near: ArmSide = "left" if off_front_deg > 0 else "right"
    far: ArmSide = "right" if off_front_deg > 0 else "left"
    return far if other else near
