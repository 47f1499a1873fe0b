"""The hand over a stroke: gestures by the vote, bearings by the median, as rays in the map."""

from __future__ import annotations

import math

import numpy as np
from deixis_schemas.messages import BEARING_STEP_DEG, BEARINGS

from .evidence import POINTING, SIDES, HandObservation
from .frames import Flags, Frames, Values
from .pointing import PointingGesture
from .robust import majority, median, median_and_spread, median_angle

# A finger seen in this part of the frames is seen: at VGA it comes and goes with the outline.
DIRECTED_SHARE = 0.3
# Axes that differ by less, degrees, are one: bearings are not told more exactly.
SAME_AXIS_DEG = 1.0


def hand_over(frames: Frames, axis_deg: float | None = None, with_curve: bool = True) -> HandObservation | None:
    """The pointing hand over a stroke; none without a pointing frame. On request without the likelihood of bearings.

    Bearings are from the direction `axis_deg` in the map, whichever way the camera was when each was seen; without it, from the
    direction to the camera in each frame.
    """
    kinds = frames.column("kind")
    pointing = frames.tells("kind")
    if not pointing.any():
        return None
    gesture, agreement = _vote(kinds[pointing], frames.weights[pointing])
    own = pointing if gesture == "invisible" else kinds == POINTING.index(gesture)
    sided = own & frames.tells("hand")
    side = majority(frames.column("hand")[sided], frames.weights[sided])
    hand = None if side is None else SIDES[side]
    told = own & frames.tells("bearing_deg")
    elevation, high_sigma = _elevation(frames, own)
    if not told.any():
        return HandObservation(gesture, agreement=agreement, hand=hand, elevation_deg=elevation, elevation_sigma_deg=high_sigma)
    turns_of_all = frames.turns_to(axis_deg)
    weights, turns, seen = frames.weights[told], turns_of_all[told], frames.column("bearing_deg")[told]
    mirrored, mirror = bool(majority(frames.column("mirrored")[told], weights)), None
    stated = median(frames.column("bearing_sigma_deg")[told], weights)
    if mirrored:
        seen = _in_front(seen)
        # Front and back turn against each other as the camera moves: what was meant stays where it is in the map.
        other, spread_of_other = median_angle(180 - seen + turns, weights)
        mirror = (other, math.hypot(stated, spread_of_other))
    bearing, spread = median_angle(seen + turns, weights)
    curve = _mean_curve(frames, told & frames.tells("has_curve"), turns_of_all) if with_curve else ()
    sigma = math.hypot(stated, spread)
    return HandObservation(gesture, bearing, sigma, mirrored, agreement, hand, curve, mirror, elevation, high_sigma)


def _elevation(frames: Frames, own: Flags) -> tuple[float | None, float | None]:
    """How high these frames point together, and its sigma, degrees; none where none of them tells."""
    told = own & frames.tells("elevation_deg")
    if not told.any():
        return None, None
    weights = frames.weights[told]
    elevation, spread = median_and_spread(frames.column("elevation_deg")[told], weights)
    stated = median(frames.column("elevation_sigma_deg")[told], weights)
    return elevation, math.hypot(stated, spread)


def _mean_curve(frames: Frames, told: Flags, turns_deg: Values) -> tuple[float, ...]:
    """Of these frames together: their mean, for they show nearly the same, and where they differ either may be right.

    `turns_deg` is added to the bearings of each frame. Those that turn alike are summed before they are turned.
    """
    if not told.any():
        return ()
    weights, curves = frames.weights[told], frames.curves[told]
    steps = np.rint(turns_deg[told] / SAME_AXIS_DEG)
    if not steps.any():
        return tuple((weights @ curves / weights.sum()).tolist())
    turns = np.array(sorted(set(steps.tolist())))
    turned = _turned(np.where(steps == turns[:, None], weights, 0.0) @ curves, turns * SAME_AXIS_DEG)
    return tuple((turned.sum(axis=0) / weights.sum()).tolist())


def _turned(curves: Values, turns_deg: Values) -> Values:
    """Curves of bearings (m, n) with all bearings of each turned (m), on a line between their values."""
    steps = np.arange(BEARINGS) - turns_deg[:, None] / BEARING_STEP_DEG
    below = np.floor(steps)
    share, place = steps - below, below.astype(np.intp)
    rows = np.arange(len(curves))[:, None]
    low, high = curves[rows, place % BEARINGS], curves[rows, (place + 1) % BEARINGS]
    return np.asarray(low + share * (high - low))


def _vote(kinds: Values, weights: Values) -> tuple[PointingGesture, float]:
    """The gesture that most frames saw, and its share. A finger seen now and then outweighs "invisible"."""
    votes = dict(zip(POINTING, np.bincount(kinds.astype(np.intp), weights, len(POINTING)).tolist(), strict=True))
    total = sum(votes.values())
    directed: PointingGesture = "point_left" if votes["point_left"] >= votes["point_right"] else "point_right"
    if votes[directed] >= DIRECTED_SHARE * total:
        return directed, votes[directed] / (votes["point_left"] + votes["point_right"])
    return "invisible", votes["invisible"] / total


def _in_front(bearings_deg: Values) -> Values:
    """Of each b and 180 - b the one that lies in front of the person, within -90 and 90."""
    size = np.abs(bearings_deg)
    return np.where(size <= 90, bearings_deg, np.copysign(180 - size, bearings_deg))
