"""The hand over a stroke: gestures by the vote, bearings by the median, as rays in the map."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from deixis_schemas.messages import BEARING_STEP_DEG, BEARINGS

from .evidence import POINTING, HandObservation, Sample, Values, Weighed
from .pointing import PointingGesture
from .robust import majority, median, median_angle

# A finger seen in this part of the frames is seen: at VGA it comes and goes with the outline.
DIRECTED_SHARE = 0.3
# Axes that differ by less, degrees, are one: bearings are not told more exactly.
SAME_AXIS_DEG = 1.0


def hand_over(weighed: Weighed, axis_deg: float | None = None) -> HandObservation | None:
    """The pointing hand over a stroke; none without a pointing sample.

    Bearings are from the direction `axis_deg` in the map, whichever way the camera was when each was seen; without it, from the
    direction to the camera in each frame.
    """
    weighted = [(sample, weight) for sample, weight in weighed if sample.pointing]
    if not weighted:
        return None
    gesture, agreement = _vote(weighted)
    own = [(sample, weight) for sample, weight in weighted if gesture in (sample.pointing, "invisible")]
    hand = majority([(s.gesture.hand, w) for s, w in own if s.gesture is not None and s.gesture.hand is not None])
    told = [(s, w) for s, w in own if s.gesture is not None and s.gesture.bearing_deg is not None]
    if not told:
        return HandObservation(gesture, agreement=agreement, hand=hand)
    mirrored = bool(majority([(s.gesture.bearing_mirrored, w) for s, w in told if s.gesture]))
    stated = median([(s.gesture.bearing_sigma_deg or 0.0, w) for s, w in told if s.gesture])
    bearing, spread = median_angle([(_bearing(s, mirrored) + s.turn_to(axis_deg), w) for s, w in told])
    mirror = None
    if mirrored:
        # Front and back turn against each other as the camera moves: what was meant stays where it is in the map.
        other, spread_of_other = median_angle([(180 - _bearing(s, mirrored) + s.turn_to(axis_deg), w) for s, w in told])
        mirror = (other, math.hypot(stated, spread_of_other))
    curve = _mean_curve(told, axis_deg)
    return HandObservation(gesture, bearing, math.hypot(stated, spread), mirrored, agreement, hand, curve, mirror)


def _bearing(sample: Sample, mirrored: bool) -> float:
    """The bearing as seen from the camera; of two that it may be, the one in front of the person."""
    bearing = (sample.gesture.bearing_deg if sample.gesture else None) or 0.0
    return _in_front(bearing) if mirrored else bearing


def _mean_curve(told: Weighed, axis_deg: float | None) -> tuple[float, ...]:
    """Of the frames together: their mean, for they show nearly the same, and where they differ either may be right."""
    turns: dict[int, list[tuple[Values, float]]] = {}
    for sample, weight in told:
        if sample.curve is not None:
            turns.setdefault(round(sample.turn_to(axis_deg) / SAME_AXIS_DEG), []).append((sample.curve, weight))
    if not turns:
        return ()
    sums = [_turned(_sum(curves), turn * SAME_AXIS_DEG) for turn, curves in turns.items()]
    total = math.fsum(weight for curves in turns.values() for _, weight in curves)
    return tuple((np.sum(sums, axis=0) / total).tolist())


def _sum(curves: Sequence[tuple[Values, float]]) -> Values:
    return np.asarray(np.array([weight for _, weight in curves]) @ np.array([curve for curve, _ in curves]))


def _turned(curve: Values, turn_deg: float) -> Values:
    """The curve of bearings with all of them turned."""
    if not turn_deg:
        return curve
    steps = np.arange(BEARINGS) - turn_deg / BEARING_STEP_DEG
    return np.asarray(np.interp(steps, np.arange(BEARINGS), curve, period=BEARINGS))


def _vote(weighted: Weighed) -> tuple[PointingGesture, float]:
    """The gesture that most frames saw, and its share. A finger seen now and then outweighs "invisible"."""
    votes: dict[PointingGesture, float] = dict.fromkeys(POINTING, 0.0)
    for sample, weight in weighted:
        if sample.pointing:
            votes[sample.pointing] += weight
    total = math.fsum(votes.values())
    directed: PointingGesture = "point_left" if votes["point_left"] >= votes["point_right"] else "point_right"
    if votes[directed] >= DIRECTED_SHARE * total:
        return directed, votes[directed] / (votes["point_left"] + votes["point_right"])
    return "invisible", votes["invisible"] / total


def _in_front(bearing: float) -> float:
    """The one of b and 180 - b that lies in front of the person, within -90 and 90."""
    if abs(bearing) <= 90:
        return bearing
    return math.copysign(180 - abs(bearing), bearing)
