"""The evidence of one stroke: what the hand and the head did over it, as one observation each.

Consecutive frames show nearly the same picture, so their errors are the same: multiplying the masses of thirty frames would
count one observation thirty times. Gestures are put to the vote and angles to the median, with a sigma that does not
shrink with the number of frames.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

from deixis_schemas.messages import Gesture, HeadPose, Side

from .evidence import HandObservation, HeadObservation, PointingGesture

T = TypeVar("T")

UNSETTLED_WEIGHT = 0.2
# A finger seen in this part of the frames is seen: at VGA it comes and goes with the outline.
DIRECTED_SHARE = 0.3
LEAST_HEAD_SHARE = 0.2
# Median absolute deviation to standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826
POINTING: tuple[PointingGesture, ...] = ("point_left", "point_right", "invisible")


@dataclass(frozen=True)
class Sample:
    """One frame of one person: what gesture and headpose said of the person, none where they said nothing."""

    stamp_ns: int
    gesture: Gesture | None
    pose: HeadPose | None

    @cached_property
    def pointing(self) -> PointingGesture | None:
        """The pointing gesture of a stroke; none in other phases and for other gestures."""
        if self.gesture is None or self.gesture.phase != "stroke":
            return None
        return next((kind for kind in POINTING if kind == self.gesture.gesture), None)

    @property
    def unclear(self) -> bool:
        """A stroke whose gesture could not be told."""
        return self.gesture is not None and self.gesture.phase == "stroke" and self.gesture.gesture == "none"

    @property
    def not_pointing(self) -> bool:
        """A stroke of an open hand, a wave and the like."""
        return self.gesture is not None and self.gesture.phase == "stroke" and self.gesture.gesture == "other"


def hand_over(samples: Sequence[Sample], settle_s: float) -> tuple[HandObservation | None, Side | None]:
    """The pointing hand over a stroke, and which hand it was; none without a pointing sample."""
    weighted = [(sample, weight) for sample, weight in _weighted(samples, settle_s) if sample.pointing]
    if not weighted:
        return None, None
    gesture, agreement = _vote(weighted)
    own = [(s.gesture, w) for s, w in weighted if s.gesture is not None and gesture in (s.pointing, "invisible")]
    hand = _majority([(g.hand, w) for g, w in own if g.hand is not None])
    told = [(g, w) for g, w in own if g.bearing_deg is not None and g.bearing_sigma_deg is not None]
    if not told:
        return HandObservation(gesture, agreement=agreement), hand
    mirrored = bool(_majority([(g.bearing_mirrored, w) for g, w in told]))
    bearings = [(_in_front(g.bearing_deg or 0.0) if mirrored else (g.bearing_deg or 0.0), w) for g, w in told]
    bearing, spread = median_and_spread(bearings)
    stated, _ = median_and_spread([(g.bearing_sigma_deg or 0.0, w) for g, w in told])
    return HandObservation(gesture, bearing, math.hypot(stated, spread), mirrored, agreement), hand


def head_over(samples: Sequence[Sample], settle_s: float) -> HeadObservation | None:
    """The head over a stroke; none where it was tracked in too few frames to tell."""
    weighted = _weighted(samples, settle_s)
    total = math.fsum(weight for _, weight in weighted)
    poses = [(s.pose, w) for s, w in weighted if s.pose is not None and s.pose.status in ("tracking", "out_of_range")]
    tracked = [(pose, weight) for pose, weight in poses if pose.status == "tracking"]
    beyond = [(pose, weight) for pose, weight in poses if pose.status == "out_of_range"]
    tracked_share = math.fsum(weight for _, weight in tracked) / total if total else 0.0
    beyond_share = math.fsum(weight for _, weight in beyond) / total if total else 0.0
    if tracked_share + beyond_share < LEAST_HEAD_SHARE:
        return None
    if beyond_share > tracked_share:
        side = _majority([(pose.side, weight) for pose, weight in beyond if pose.side is not None])
        return HeadObservation(None, None, side, beyond_share)
    yaw, spread = median_and_spread([(pose.yaw_deg or 0.0, weight) for pose, weight in tracked])
    stated, _ = median_and_spread([(pose.yaw_sigma_deg or 0.0, weight) for pose, weight in tracked])
    return HeadObservation(yaw, math.hypot(stated, spread), None, tracked_share)


def head_now(pose: HeadPose | None) -> HeadObservation | None:
    """The head as one frame shows it."""
    if pose is None or pose.status not in ("tracking", "out_of_range"):
        return None
    return HeadObservation(pose.yaw_deg if pose.status == "tracking" else None, pose.yaw_sigma_deg, pose.side)


def median_and_spread(weighted: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Weighted median, and the weighted median absolute deviation from it as a standard deviation."""
    centre = _median(weighted)
    return centre, MAD_TO_SIGMA * _median([(abs(value - centre), weight) for value, weight in weighted])


def _median(weighted: Sequence[tuple[float, float]]) -> float:
    ordered = sorted(weighted)
    half = math.fsum(weight for _, weight in ordered) / 2
    reached = 0.0
    for value, weight in ordered:
        reached += weight
        if reached >= half:
            return value
    return ordered[-1][0]


def _weighted(samples: Sequence[Sample], settle_s: float) -> list[tuple[Sample, float]]:
    """Samples with weights: at the start of a stroke the head may still be on its way."""
    if not samples:
        return []
    settled_ns = samples[0].stamp_ns + int(settle_s * 1e9)
    return [(sample, 1.0 if sample.stamp_ns >= settled_ns else UNSETTLED_WEIGHT) for sample in samples]


def _vote(weighted: Sequence[tuple[Sample, float]]) -> tuple[PointingGesture, float]:
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


def _majority(weighted: Sequence[tuple[T, float]]) -> T | None:
    """The value of the largest total weight; the earlier one of equals."""
    totals: dict[T, float] = {}
    for value, weight in weighted:
        totals[value] = totals.get(value, 0.0) + weight
    return max(totals, key=lambda value: totals[value]) if totals else None


def _in_front(bearing: float) -> float:
    """The one of b and 180 - b that lies in front of the person, within -90 and 90."""
    if abs(bearing) <= 90:
        return bearing
    return math.copysign(180 - abs(bearing), bearing)
