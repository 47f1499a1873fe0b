"""Does a held hand point? Log odds of single frames and of strokes, by tables that were fitted (`pointing.npz`).

Frames (`held_hand.py`): fitted on hands of the simulator's people who point or do any of fourteen other things, near and far,
cut out as badly as a tracker does. Strokes: fitted on what the tracker makes of the simulator's clips. Both by
`fitting/fit_pointing.py`, on fitting seeds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from .held_hand import HeldHand
from .log_odds import LogOdds, Table
from .phases import Way

Measures = dict[str, tuple[float, ...]]
Knots = Mapping[str, tuple[tuple[float, ...], ...]]

FRAME_KNOTS: Knots = {
    "place": ((-2.2, -1.4, -0.7, 0.0, 0.7, 1.4, 2.1, 2.8, 3.5, 4.4), (-0.8, -0.1, 0.6, 1.3, 2.0, 2.7, 3.4)),
    "tip": ((-0.8, -0.5, -0.2, 0.1, 0.4, 0.7, 1.0), (-0.9, -0.6, -0.3, 0.0, 0.3, 0.6)),
    "arm": ((0.5, 1.2, 1.9, 2.6, 3.3, 4.0), (-120.0, -80.0, -40.0, -15.0, 0.0, 15.0, 40.0, 80.0, 120.0)),
    "size": ((0.08, 0.14, 0.2, 0.26, 0.34, 0.44), (0.2, 0.35, 0.5, 0.65, 0.85, 1.1)),
    "fingers": ((0.0, 0.17, 0.3, 0.45, 0.7), (0.0, 0.17, 0.3, 0.45)),
    "spread": ((0.0, 1.0, 2.0, 3.0, 4.0), (-60.0, -20.0, 20.0, 50.0, 80.0)),
    "fellow": ((0.0, 0.7, 1.4, 2.2, 3.2), (0.5, 1.3, 2.1, 2.9, 3.7)),
    "alone": ((0.0,),),
}
"""Where each table has values. place: palm, out and down. tip: from the palm. arm: reach, and bend in degrees. size: of the
palm, and of the whole. fingers: the longest, and the next. spread: how many stand out, and how steeply the hand goes up.
fellow: how far the other hand is from where it mirrors this one, and how far down it is; alone: it is not seen.
"""
STROKE_KNOTS: Knots = {
    "posture": ((-6.0, -4.0, -2.5, -1.0, 0.0, 1.0, 2.5, 4.0, 6.0),),
    "lasting": ((0.0, 0.2, 0.4, 0.8, 1.5),),
    "shaking": ((0.0, 0.04, 0.08, 0.15, 0.3),),
    "way": ((-0.5, 0.5, 1.5, 2.5, 4.0), (-1.5, -0.5, 0.5, 1.5, 3.0)),
    "haste": ((0.1, 0.3, 0.6, 1.0, 2.0),),
    "unseen": ((0.0,),),
}
"""posture: mean log odds of the last frames. lasting: seconds since the hand stands. shaking: how far it strays, face widths.
way, haste: up and aside from where it rested, and the seconds that took; unseen: it was not seen coming.
"""


@cache
def frame_odds() -> LogOdds:
    """Of a hand in one frame."""
    return _stored("frame", FRAME_KNOTS)


@cache
def stroke_odds() -> LogOdds:
    """Of a stroke so far."""
    return _stored("stroke", STROKE_KNOTS)


def frame_measures(hand: HeldHand) -> Measures:
    """What `frame_odds` weighs."""
    longest, second = (*hand.fingers, 0.0, 0.0)[:2]
    measures: Measures = {
        "place": hand.palm,
        "tip": hand.tip,
        "arm": (hand.reach, hand.bend_deg),
        "size": (hand.palm_radius, hand.breadth),
        "fingers": (longest, second),
        "spread": (float(len(hand.fingers)), hand.elevation_deg),
    }
    if hand.fellow is None:
        return {**measures, "alone": (0.0,)}
    return {**measures, "fellow": (math.dist(hand.palm, hand.fellow), hand.fellow[1])}


def stroke_measures(posture: float, lasting_s: float, shaking: float, way: Way | None) -> Measures:
    """What `stroke_odds` weighs; `posture`: mean log odds of the last frames."""
    measures: Measures = {"posture": (posture,), "lasting": (lasting_s,), "shaking": (shaking,)}
    if way is None:
        return {**measures, "unseen": (0.0,)}
    return {**measures, "way": (way.up, way.aside), "haste": (way.seconds,)}


def _stored(model: str, knots: Knots) -> LogOdds:
    with files("deixis_gesture").joinpath("pointing.npz").open("rb") as file:
        stored = np.load(file)
        tables = {
            name: Table(tuple(np.array(axis) for axis in axes), stored[f"{model}.{name}"]) for name, axes in knots.items()
        }
        return LogOdds(float(stored[f"{model}.constant"]), tables)
