"""What people do: each function draws one action, or a row of them, from a start on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from .dice import Dice, Range
from .scene import QUIET_GESTURES, Action, ArmSide, ArmStyle, HandShape, HeadTurn, Pointing, Quiet, QuietGesture

ARM_REACH_DEG = 118.0
"""How far to the side of the body's front an arm points without a step."""
CROSS_REACH_DEG = 50.0
"""The same with the arm of the other side."""
SHORTEST_HOLD_S = 0.8
LONGEST_HOLD_S = 2.1
HOLD_IN_A_ROW_S = 1.6
TURN_REACH_DEG = 135.0
"""How far head and trunk together turn away from the body's front."""


@dataclass(frozen=True)
class Habits:
    """How people point, gesture and look about: ranges from and to, choices by weight, shares. move_s: preparation and
    retraction of a pointing; quiet_move_s: of another gesture. other_arm: not that of the side. turn_s: a look's way there.
    most_head_gain: what is drawn above it is that, so that a range beyond it has most heads turn so far.
    """

    arm_reach_deg: float = ARM_REACH_DEG
    other_arm: float = 0.15
    looks_away: float = 0.15
    styles: Mapping[ArmStyle, float] = field(default_factory=lambda: {"straight": 0.55, "bent": 0.3, "hip": 0.15})
    hands: Mapping[HandShape, float] = field(default_factory=lambda: {"index": 0.8, "flat": 0.2})
    move_s: Range = (0.35, 0.9)
    shortest_hold_s: float = SHORTEST_HOLD_S
    head_gain: Range = (0.3, 1.05)
    most_head_gain: float = 1.05
    head_lag_s: Range = (-0.2, 0.3)
    head_overshoot_deg: Range = (0, 5)
    torso_gain: Range = (0.5, 1.4)
    pronation_deg: Range = (0, 90)
    gestures: tuple[QuietGesture, ...] = QUIET_GESTURES
    quiet_move_s: Range = (0.35, 0.8)
    quiet_hold_s: Range = (0.9, 2.6)
    rate_hz: Range = (1.2, 3.2)
    turn_deg: Range = (15.0, 130.0)
    turn_s: Range = (0.35, 0.9)
    turn_hold_s: Range = (0.3, 1.5)


ANY_HABITS = Habits()


@dataclass(frozen=True)
class Target:
    """A POI as a standing person has it: degrees from the body's front, positive toward the person's own left."""

    poi: str
    off_front_deg: float

    def reachable(self, arm_reach_deg: float = ARM_REACH_DEG) -> bool:
        """Whether an arm gets there."""
        return abs(self.off_front_deg) <= arm_reach_deg


def draw_pointing(dice: Dice, start_s: float, target: Target, longest_hold_s: float, habits: Habits = ANY_HABITS) -> Pointing:
    """One pointing at this target."""
    looks_away, at_robot = dice.chance(habits.looks_away), dice.chance(0.5)
    return Pointing(
        start_s=round(start_s, 2),
        preparation_s=dice.between(*habits.move_s, 2),
        hold_s=dice.between(habits.shortest_hold_s, longest_hold_s, 2),
        retraction_s=dice.between(*habits.move_s, 2),
        poi=target.poi,
        arm=_draw_arm(dice, target.off_front_deg, habits.other_arm),
        style=dice.weighed(habits.styles),
        hand=dice.weighed(habits.hands),
        looks=("robot" if at_robot else "elsewhere") if looks_away else "poi",
        elsewhere_deg=dice.between(-70, 70, 1),
        head_gain=min(dice.between(*habits.head_gain), habits.most_head_gain),
        head_lag_s=dice.between(*habits.head_lag_s, 2),
        head_overshoot_deg=dice.between(*habits.head_overshoot_deg, 1),
        torso_gain=dice.between(*habits.torso_gain, 2),
        pronation_deg=dice.between(*habits.pronation_deg, 0),
    )


def draw_pointings(
    dice: Dice, start_s: float, targets: Sequence[Target], count: int, habits: Habits = ANY_HABITS
) -> list[Action]:
    """So many pointings in a row, at different targets; fewer where fewer are in reach."""
    row: list[Action] = []
    for target in dice.shuffled([target for target in targets if target.reachable(habits.arm_reach_deg)])[:count]:
        pointing = draw_pointing(dice, start_s, target, LONGEST_HOLD_S if count == 1 else HOLD_IN_A_ROW_S, habits)
        row.append(pointing)
        start_s = pointing.end_s + dice.between(0.25, 0.6, 2)
    return row


def draw_quiet(dice: Dice, start_s: float, habits: Habits = ANY_HABITS) -> Quiet:
    """One gesture that is no pointing."""
    return Quiet(
        gesture=dice.one(habits.gestures),
        start_s=round(start_s, 2),
        preparation_s=dice.between(*habits.quiet_move_s, 2),
        hold_s=dice.between(*habits.quiet_hold_s, 2),
        retraction_s=dice.between(*habits.quiet_move_s, 2),
        arm=dice.weighed({"right": 0.6, "left": 0.4}),
        rate_hz=dice.between(*habits.rate_hz, 2),
    )


def draw_quiets(dice: Dice, start_s: float, until_s: float, count: int, habits: Habits = ANY_HABITS) -> list[Action]:
    """So many quiet gestures in a row, as far as they end in time."""
    row: list[Action] = []
    for _ in range(count):
        gesture = draw_quiet(dice, start_s, habits)
        if gesture.end_s > until_s and row:
            break
        row.append(gesture)
        start_s = gesture.end_s + dice.between(0.15, 0.6, 2)
    return row


def draw_turn(dice: Dice, start_s: float, front_deg: float, habits: Habits = ANY_HABITS) -> HeadTurn:
    """A look to a side. `front_deg`: azimuth of the body's front; the neck does not go farther than TURN_REACH_DEG from it."""
    size, side = dice.between(*habits.turn_deg, 1), dice.one((-1, 1))
    azimuth = min(max(side * size, front_deg - TURN_REACH_DEG), front_deg + TURN_REACH_DEG)
    return HeadTurn(
        start_s=round(start_s, 2),
        azimuth_deg=round(azimuth, 1),
        pitch_deg=dice.near(0, 8, -25, 25, 1),
        turn_s=dice.between(*habits.turn_s, 2),
        hold_s=dice.between(*habits.turn_hold_s, 2),
        torso_gain=dice.between(0.1, 1.0, 2),
    )


def draw_turns(
    dice: Dice, start_s: float, until_s: float, front_deg: float, count: int, habits: Habits = ANY_HABITS
) -> list[Action]:
    """So many looks in a row, as far as they end in time."""
    row: list[Action] = []
    for _ in range(count):
        turn = draw_turn(dice, start_s, front_deg, habits)
        if turn.end_s > until_s and row:
            break
        row.append(turn)
        start_s = turn.end_s + dice.between(0.1, 0.6, 2)
    return row


def draw_nods(dice: Dice, start_s: float, count: int) -> list[Action]:
    """So many nods in a row, down and up by turns, each a little aside."""
    row: list[Action] = []
    for number in range(count):
        nod = HeadTurn(
            start_s=round(start_s, 2),
            azimuth_deg=dice.near(0, 3, -6, 6, 1),
            pitch_deg=dice.between(12, 24, 1) * (-1, 1)[number % 2],
            turn_s=dice.between(0.4, 0.6, 2),
            hold_s=dice.between(0.2, 0.5, 2),
            torso_gain=0.1,
        )
        row.append(nod)
        start_s = nod.end_s + dice.between(0.1, 0.4, 2)
    return row


def _draw_arm(dice: Dice, off_front_deg: float, other_arm: float) -> ArmSide:
    """Usually the arm of the side that is pointed to."""
    other = dice.chance(other_arm) and abs(off_front_deg) <= CROSS_REACH_DEG
    near: ArmSide = "left" if off_front_deg > 0 else "right"
    far: ArmSide = "right" if off_front_deg > 0 else "left"
    return far if other else near
