"""The evidence on one person: from what the stages said of a frame or a stroke to an observation of the hand and of the head.

Consecutive frames show nearly the same picture, so their errors are the same: multiplying the masses of thirty frames would
count one observation thirty times. Over a stroke gestures are put to the vote and angles to the median, with a sigma that
does not shrink with the number of frames.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple, TypeVar

from deixis_schemas.messages import BEARINGS, Gesture, HeadPose, Side, SourceStatus

from .config import EpisodesConfig
from .joining import GESTURE, HEADPOSE, JoinedFrame
from .localisation import PersonPlace, wrapped_deg

T = TypeVar("T")
PointingGesture = Literal["point_left", "invisible", "point_right"]
StageStatus = tuple[SourceStatus, str]

POINTING: tuple[PointingGesture, ...] = ("point_left", "point_right", "invisible")
UNSETTLED_WEIGHT = 0.2
# A finger seen in this part of the frames is seen: at VGA it comes and goes with the outline.
DIRECTED_SHARE = 0.3
LEAST_HEAD_SHARE = 0.2
# Median absolute deviation to standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826
NO_ANSWER: StageStatus = ("late", "did not answer this frame in time")
UNKNOWN_PERSON = "the stage does not follow this person"


@dataclass(frozen=True)
class Sample:
    """One frame of one person: what gesture and headpose said of the person, none where they said nothing.

    `at_ns` is the time of `RunClock`, for durations; `stamp_ns` is the frame's stamp, to be published.
    """

    at_ns: int
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


Weighed = Sequence[tuple[Sample, float]]


@dataclass(frozen=True)
class HandObservation:
    """A pointing stroke: the gesture recognised and, where it could be told, the bearing pointed to and by which hand.

    `mirrored`: the bearing may as well be 180 - bearing. `agreement` is the share of the frames that said so. `likelihood` is
    that of bearings -180, -175 ... 175, where the stage tells it: it then counts instead of bearing and sigma.
    """

    gesture: PointingGesture
    bearing_deg: float | None = None
    bearing_sigma_deg: float | None = None
    mirrored: bool = False
    agreement: float = 1.0
    hand: Side | None = None
    likelihood: tuple[float, ...] = ()

    @property
    def mirror_deg(self) -> float | None:
        """The other bearing that it may be; none where there is only one."""
        return wrapped_deg(180.0 - self.bearing_deg) if self.mirrored and self.bearing_deg is not None else None

    @property
    def bearings(self) -> list[tuple[float, float]]:
        """The bearings that it may be, each with its sigma, degrees; none where none could be told."""
        told = (self.bearing_deg, self.mirror_deg)
        return [(bearing, self.bearing_sigma_deg or 0.0) for bearing in told if bearing is not None]


@dataclass(frozen=True)
class HeadObservation:
    """A tracked head: its yaw, or (`yaw_deg` none) that it is turned beyond the range, to `side` where that is known.

    `beyond_deg` is that range, where the stage tells it.
    """

    yaw_deg: float | None
    yaw_sigma_deg: float | None = None
    side: Side | None = None
    agreement: float = 1.0
    beyond_deg: float | None = None


class View(NamedTuple):
    """What hand and head showed while the person stood in one place, and which share of all that each showed it is.

    `place` is none where that is the place where the person stands now.
    """

    hand: HandObservation | None
    head: HeadObservation | None
    place: PersonPlace | None = None
    hand_share: float = 1.0
    head_share: float = 1.0


class Witness(NamedTuple):
    """How one stage stands, its process, and in words what it observed or why nothing. `stamp_ns` is the time it speaks of."""

    status: SourceStatus
    observed: str
    producer: str = ""
    stamp_ns: int | None = None


class Evidence(NamedTuple):
    """What hand and head of one person show, none where nothing can be told, and who says so.

    `views`: the same, from the places where it was seen; empty where that was one place.
    """

    hand: HandObservation | None
    gesture: Witness
    head: HeadObservation | None
    headpose: Witness
    views: tuple[View, ...] = ()


def stages_of(frame: JoinedFrame, statuses: Mapping[str, StageStatus]) -> dict[str, Witness]:
    """How headpose and gesture stand for one frame; `statuses` speaks for those that are missing in it."""
    stages = {}
    for stage in (HEADPOSE, GESTURE):
        part = frame.part_of(stage)
        if part is not None:
            stages[stage] = Witness("ok", "", f"{part.stage}/{part.instance}")
            continue
        status, reason = statuses.get(stage, NO_ANSWER)
        stages[stage] = Witness(*(NO_ANSWER if status == "ok" else (status, reason)))
    return stages


def gather(stroke: Sequence[Sample], latest: Sample, stages: Mapping[str, Witness], config: EpisodesConfig) -> Evidence:
    """The evidence of a stroke up to the latest frame; of that frame alone where the person is in no stroke."""
    if stroke:
        return _of_stroke(stroke, latest, stages, config)
    gesture, headpose = stages[GESTURE], stages[HEADPOSE]
    head = head_now(latest.pose)
    return Evidence(
        hand=None,
        gesture=_resting(latest, gesture) if gesture.status == "ok" else gesture,
        head=head,
        headpose=_head_witness(head, latest.pose, headpose, latest.stamp_ns) if headpose.status == "ok" else headpose,
    )


def _of_stroke(stroke: Sequence[Sample], latest: Sample, stages: Mapping[str, Witness], config: EpisodesConfig) -> Evidence:
    """A stage that is dead counts for nothing from then on. One that is only late counts by what it said a moment ago."""
    gesture, headpose = stages[GESTURE], stages[HEADPOSE]
    posed = [sample for sample in stroke if sample.pose is not None]
    weighed = weigh(stroke, config.settle_s)
    hand, head = None, None
    if _counts(gesture, stroke, latest, config):
        hand = hand_over(weighed)
        gesture = _hand_witness(hand, gesture, stroke[-1].stamp_ns)
    if _counts(headpose, posed, latest, config):
        head = head_over(weighed)
        headpose = _head_witness(head, stroke[-1].pose, headpose, posed[-1].stamp_ns if posed else None)
    return Evidence(hand, gesture, head, headpose)


def _counts(stage: Witness, told: Sequence[Sample], latest: Sample, config: EpisodesConfig) -> bool:
    if stage.status == "late":
        return bool(told) and latest.at_ns - told[-1].at_ns <= config.max_evidence_age_s * 1e9
    return stage.status == "ok"


# --- the hand ---------------------------------------------------------------------------------------------------------


def hand_over(weighed: Weighed) -> HandObservation | None:
    """The pointing hand over a stroke; none without a pointing sample."""
    weighted = [(sample, weight) for sample, weight in weighed if sample.pointing]
    if not weighted:
        return None
    gesture, agreement = _vote(weighted)
    own = [(s.gesture, w) for s, w in weighted if s.gesture is not None and gesture in (s.pointing, "invisible")]
    hand = _majority([(g.hand, w) for g, w in own if g.hand is not None])
    told = [(g, w) for g, w in own if g.bearing_deg is not None and g.bearing_sigma_deg is not None]
    if not told:
        return HandObservation(gesture, agreement=agreement, hand=hand)
    mirrored = bool(_majority([(g.bearing_mirrored, w) for g, w in told]))
    bearings = [(_in_front(g.bearing_deg or 0.0) if mirrored else (g.bearing_deg or 0.0), w) for g, w in told]
    bearing, spread = median_and_spread(bearings)
    stated, _ = median_and_spread([(g.bearing_sigma_deg or 0.0, w) for g, w in told])
    return HandObservation(gesture, bearing, math.hypot(stated, spread), mirrored, agreement, hand, _mean_likelihood(told))


def _mean_likelihood(told: Sequence[tuple[Gesture, float]]) -> tuple[float, ...]:
    """Of the frames together: their mean, for they show nearly the same, and where they differ either may be right."""
    curves = [(gesture.bearing_likelihood, weight) for gesture, weight in told if gesture.bearing_likelihood]
    if not curves:
        return ()
    total = math.fsum(weight for _, weight in curves)
    return tuple(math.fsum(curve[i] * weight for curve, weight in curves) / total for i in range(BEARINGS))


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


def _resting(latest: Sample, stage: Witness) -> Witness:
    if latest.gesture is None:
        return Witness("not_tracking", UNKNOWN_PERSON, stage.producer)
    observed = f"no pointing: {latest.gesture.phase}, {latest.gesture.gesture}"
    return Witness("ok", observed, stage.producer, latest.stamp_ns)


def _hand_witness(hand: HandObservation | None, stage: Witness, stamp_ns: int) -> Witness:
    if hand is None:
        return Witness("not_tracking", UNKNOWN_PERSON, stage.producer)
    bearing = ""
    if hand.bearing_deg is not None and hand.bearing_sigma_deg is not None:
        mirror = f" or {hand.mirror_deg:.1f}" if hand.mirror_deg is not None else ""
        bearing = f", bearing {hand.bearing_deg:.1f}{mirror} +- {hand.bearing_sigma_deg:.1f} deg"
    return Witness(stage.status, f"{hand.gesture}{bearing}", stage.producer, stamp_ns)


# --- the head ---------------------------------------------------------------------------------------------------------


def head_now(pose: HeadPose | None) -> HeadObservation | None:
    """The head as one frame shows it."""
    if pose is None or pose.status not in ("tracking", "out_of_range"):
        return None
    return HeadObservation(pose.yaw_deg if pose.status == "tracking" else None, pose.yaw_sigma_deg, pose.side)


def head_over(weighed: Weighed) -> HeadObservation | None:
    """The head over a stroke; none where it was tracked in too few frames to tell."""
    total = math.fsum(weight for _, weight in weighed)
    poses = [(s.pose, w) for s, w in weighed if s.pose is not None and s.pose.status in ("tracking", "out_of_range")]
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


def _head_witness(head: HeadObservation | None, pose: HeadPose | None, stage: Witness, stamp_ns: int | None) -> Witness:
    if head is None:
        why = f"head {pose.status}" if pose is not None else UNKNOWN_PERSON
        return Witness("not_tracking", why, stage.producer)
    if head.yaw_deg is None:
        side = f" to the {head.side}" if head.side else ""
        return Witness(stage.status, f"out of range{side}", stage.producer, stamp_ns)
    observed = f"yaw {head.yaw_deg:.1f} +- {head.yaw_sigma_deg or 0:.1f} deg"
    return Witness(stage.status, observed, stage.producer, stamp_ns)


# --- weighing frames --------------------------------------------------------------------------------------------------


def weigh(samples: Sequence[Sample], settle_s: float) -> Weighed:
    """The samples of a stroke with their weights: at the start of a stroke the head may still be on its way."""
    if not samples:
        return []
    settled_ns = samples[0].at_ns + int(settle_s * 1e9)
    return [(sample, 1.0 if sample.at_ns >= settled_ns else UNSETTLED_WEIGHT) for sample in samples]


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


def _majority(weighted: Sequence[tuple[T, float]]) -> T | None:
    """The value of the largest total weight; the earlier one of equals."""
    totals: dict[T, float] = {}
    for value, weight in weighted:
        totals[value] = totals.get(value, 0.0) + weight
    return max(totals, key=lambda value: totals[value]) if totals else None
