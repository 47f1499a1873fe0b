"""What a scene is about, drawn before anything is placed, so that no placing that fails makes one plan rarer than another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from .dice import Dice
from .scene import Kind

Plot = Literal["point", "gestures", "idle", "mixed", "empty", "through", "in_point", "in_gestures", "turns", "nods"]
Move = Literal["none", "pan", "drive"]

PLOTS: dict[Kind, dict[Plot, float]] = {
    "point": {"point": 1.0},
    "quiet": {"gestures": 0.58, "idle": 0.08, "mixed": 0.14, "empty": 0.1, "through": 0.1},
    "several": {"point": 0.8, "gestures": 0.2},
    "walk": {"in_point": 0.55, "through": 0.27, "in_gestures": 0.18},
    "turn": {"turns": 1.0},
}


@dataclass(frozen=True)
class Plots:
    """What happens in scenes, and how often: by weight, or shares. company: people of scenes with several; in_a_row: gestures
    or looks; hand_may_leave: raised hands that may be outside the picture.
    """

    kinds: Mapping[Kind, float] = field(
        default_factory=lambda: {"point": 0.45, "quiet": 0.2, "several": 0.15, "walk": 0.1, "turn": 0.1}
    )
    of_kind: Mapping[Kind, Mapping[Plot, float]] = field(default_factory=lambda: PLOTS)
    moves: Mapping[Move, float] = field(default_factory=lambda: {"none": 0.82, "pan": 0.09, "drive": 0.09})
    company: Mapping[int, float] = field(default_factory=lambda: {2: 0.65, 3: 0.35})
    in_a_row: Mapping[int, float] = field(default_factory=lambda: {1: 0.4, 2: 0.4, 3: 0.2})
    two_pointings: float = 0.28
    gesture_before: float = 0.1
    second_pointer: float = 0.2
    hand_may_leave: float = 0.06


ANY_PLOTS = Plots()


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

    @property
    def points(self) -> bool:
        """Whether the first person points."""
        return self.plot in ("point", "in_point")


def draw_plan(dice: Dice, kind: Kind, plots: Plots = ANY_PLOTS) -> Plan:
    """The plan of a scene of this kind."""
    plot = dice.weighed(plots.of_kind[kind])
    company = dice.weighed(plots.company)
    two, several = dice.chance(plots.two_pointings), dice.weighed(plots.in_a_row)
    alone = 0 if plot == "empty" else 1
    counts = {"point": 2 if two else 1, "in_point": 1, "in_gestures": 1}
    return Plan(
        plot=plot,
        people=company if kind == "several" else alone,
        count=counts.get(plot, several),
        move=dice.weighed(plots.moves),
        gesture_before=dice.chance(plots.gesture_before) and plot == "point" and not two,
        second_pointer=dice.chance(plots.second_pointer),
        hand_may_leave=dice.chance(plots.hand_may_leave),
    )
