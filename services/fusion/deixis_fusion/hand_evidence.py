"""The hand over a stroke: gestures by the vote, bearings by the median, as rays in the map."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from deixis_schemas.messages import BEARING_STEP_DEG, BEARINGS

from .evidence import HANDS, HandObservation
from .frames import ROUNDING, Flags, Frames, Values
from .pointing import PointingGesture
from .robust import Middle, middles_of

# A finger seen in this part of the frames is seen: at VGA it comes and goes with the outline.
DIRECTED_SHARE = 0.3
# Axes that differ by less, degrees, are one: bearings are not told more exactly.
SAME_AXIS_DEG = 1.0


class Vote(NamedTuple):
    """The gesture that most frames saw, the share of those that agree, and which show it; none where all do."""

    gesture: PointingGesture
    agreement: float
    own: Flags | None


def vote(frames: Frames, totals: Mapping[str, float]) -> Vote | None:
    """What the frames vote for; none without a pointing frame. A finger seen now and then outweighs "invisible"."""
    beside = totals["point_left"] + totals["point_right"]
    pointing = beside + totals["invisible"]
    if not pointing:
        return None
    directed: PointingGesture = "point_left" if totals["point_left"] >= totals["point_right"] - ROUNDING else "point_right"
    if totals[directed] >= DIRECTED_SHARE * pointing - ROUNDING:
        own = None if totals[directed] == totals["frame"] else frames.show(directed)
        return Vote(directed, totals[directed] / beside, own)
    shown = frames.show("point_left") | frames.show("point_right") | frames.show("invisible")
    return Vote("invisible", totals["invisible"] / pointing, None if shown.all() else shown)


class HandFrames:
    """The frames of a stroke that show what was voted for, and what these measured of the hand (4, n): see `evidence.ROW`.

    `measured` becomes not a number in the other frames. `turns_deg` (n) is added to the bearings of each.
    """

    def __init__(self, frames: Frames, totals: Mapping[str, float], measured: Values, turns_deg: Values) -> None:
        self._frames, self._totals, self._turns = frames, totals, turns_deg
        self._weights, self._mirror = frames.weights, None
        self.voted = vote(frames, totals)
        if self.voted is None:
            return
        if self.voted.own is not None:
            self._weights, measured[:, ~self.voted.own] = self._weights * self.voted.own, np.nan
            self._totals = frames.totals(self._weights)
        self._told = self._weights * ~np.isnan(measured[0])
        if self._totals["mirrored"] and _is_mirrored(frames.column("mirrored"), self._told):
            measured[0] = _in_front(measured[0])
            # Front and back turn against each other as the camera moves: what was meant stays where it is in the map.
            behind = np.concatenate([[180 - measured[0] + turns_deg], measured[1:]])
            self._mirror = middles_of(behind, frames.early)[0]
        measured[0] += turns_deg

    def observed(self, middle: Middle, with_curve: bool) -> HandObservation | None:
        """What they show together, with what they measured in the middle; on request without the likelihood of bearings."""
        if self.voted is None:
            return None
        frames, mirror = self._frames, self._mirror
        return HandObservation(
            gesture=self.voted.gesture,
            bearing_deg=middle.direction_deg,
            bearing_sigma_deg=middle.sigma_deg,
            mirrored=mirror is not None,
            agreement=self.voted.agreement,
            hand=frames.side_of(HANDS, self._totals, self._weights),
            likelihood=self._curve() if with_curve and self._totals["has_curve"] else (),
            mirror=None if mirror is None else (mirror.direction_deg or 0.0, mirror.sigma_deg or 0.0),
            elevation_deg=middle.height_deg,
            elevation_sigma_deg=middle.height_sigma_deg,
        )

    def _curve(self) -> tuple[float, ...]:
        return mean_curve(self._told * self._frames.column("has_curve"), self._frames.curves, self._turns)


def _is_mirrored(mirrored: Values, weights: Values) -> bool:
    """Whether most frames with a bearing say that it may as well lie behind; of as many, whether the first of them does."""
    more = float((2 * mirrored - 1) @ weights)
    return more > ROUNDING or (more > -ROUNDING and bool(mirrored[weights > 0][:1].any()))


def mean_curve(weights: Values, curves: Values, turns_deg: Values) -> tuple[float, ...]:
    """The weighted mean of curves (n, bearings): they show nearly the same, and where they differ either may be right.

    `turns_deg` (n) is added to the bearings of each; between its values a curve goes on a line. Those that turn by as many
    steps are summed before they are turned.
    """
    total = float(np.add.reduce(weights))
    if not total:
        return ()
    steps = np.rint(turns_deg / SAME_AXIS_DEG) * (SAME_AXIS_DEG / -BEARING_STEP_DEG)
    whole = np.arange(math.floor(np.minimum.reduce(steps)), math.floor(np.maximum.reduce(steps)) + 2)
    shares = np.maximum(0.0, 1 - np.abs(steps - whole[:, None]))
    mean = (shares * (weights / total)) @ curves
    turned = [np.concatenate([of[by:], of[:by]]) for of, by in zip(mean, (whole % BEARINGS).tolist(), strict=True)]
    return tuple(sum(turned[1:], turned[0]).tolist())


def _in_front(bearings_deg: Values) -> Values:
    """Of each b and 180 - b the one that lies in front of the person, within -90 and 90."""
    size = np.abs(bearings_deg)
    return np.where(size <= 90, bearings_deg, np.copysign(180 - size, bearings_deg))
