"""What a scene is about, drawn before anything is placed, so that no placing that fails makes one plan rarer than another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .dice import Dice
from .scene import Kind

Plot = Literal["point", "gestures", "idle", "mixed", "empty", "through", "in_point", "in_gestures", "turns"]
Move = Literal["none", "pan", "drive"]

PLOTS: dict[Kind, dict[Plot, float]] = {
    "point": {"point": 1.0},
    "quiet": {"gestures": 0.58, "idle": 0.08, "mixed": 0.14, "empty": 0.1, "through": 0.1},
    "several": {"point": 0.8, "gestures": 0.2},
    "walk": {"in_point": 0.55, "through": 0.27, "in_gestures": 0.18},
    "turn": {"turns": 1.0},
}
MOVES: dict[Move, float] = {"none": 0.82, "pan": 0.09, "drive": 0.09}
TWO_POINTINGS_SHARE = 0.28
GESTURE_BEFORE_SHARE = 0.1
SECOND_POINTER_SHARE = 0.2
HAND_MAY_LEAVE_SHARE = 0.06


@dataclass(frozen=True)
class Plan:
    """`count`: actions of the plot in a row. `hand_may_leave`: the raised hand may be outside the picture."""

    plot: Plot
    people: int
    count: int
    move: Move
    gesture_before: bool
    second_pointer: bool
    hand_may_leave: bool


def draw_plan(dice: Dice, kind: Kind) -> Plan:
    """The plan of a scene of this kind."""
    plot = dice.weighed(PLOTS[kind])
    company = dice.weighed({2: 0.65, 3: 0.35})
    two, several = dice.chance(TWO_POINTINGS_SHARE), dice.weighed({1: 0.4, 2: 0.4, 3: 0.2})
    alone = 0 if plot == "empty" else 1
    counts = {"point": 2 if two else 1, "in_point": 1, "in_gestures": 1}
    return Plan(
        plot=plot,
        people=company if kind == "several" else alone,
        count=counts.get(plot, several),
        move=dice.weighed(MOVES),
        gesture_before=dice.chance(GESTURE_BEFORE_SHARE) and plot == "point" and not two,
        second_pointer=dice.chance(SECOND_POINTER_SHARE),
        hand_may_leave=dice.chance(HAND_MAY_LEAVE_SHARE),
    )
