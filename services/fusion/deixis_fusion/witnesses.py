"""What each source says of one person in one frame or stroke, and how far it can be relied on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from deixis_schemas.messages import Gesture, HeadPose, Side, SourceStatus

from .config import FusionConfig
from .evidence import HandObservation, HeadObservation
from .joining import GESTURE, HEADPOSE, JoinedFrame
from .stroke import Sample, hand_over, head_now, head_over

StageStatus = tuple[SourceStatus, str]
NO_ANSWER: StageStatus = ("late", "did not answer this frame in time")


@dataclass(frozen=True)
class SourceView:
    """One stage as seen from one frame: whether it answered, why not, and who it was."""

    status: SourceStatus
    reason: str = ""
    producer: str = ""


@dataclass(frozen=True)
class Witness:
    """What one source contributes: an observation, or none and then why. `stamp_ns` is the time it speaks of."""

    status: SourceStatus
    observed: str
    producer: str
    stamp_ns: int | None


@dataclass(frozen=True)
class Witnesses:
    """Hand and head of one person."""

    hand: HandObservation | None
    hand_side: Side | None
    gesture: Witness
    head: HeadObservation | None
    headpose: Witness


def views_of(frame: JoinedFrame, statuses: Mapping[str, StageStatus]) -> dict[str, SourceView]:
    """How headpose and gesture stand for one frame; `statuses` speaks for those that are missing in it."""
    views = {}
    for stage in (HEADPOSE, GESTURE):
        part = frame.part_of(stage)
        if part is not None:
            views[stage] = SourceView("ok", producer=f"{part.stage}/{part.instance}")
            continue
        status, reason = statuses.get(stage, NO_ANSWER)
        views[stage] = SourceView(*(NO_ANSWER if status == "ok" else (status, reason)))
    return views


def in_frame(sample: Sample, views: Mapping[str, SourceView]) -> Witnesses:
    """A person who is not in a stroke: the head as this frame shows it; a hand at rest says nothing."""
    gesture = _absent(views[GESTURE]) or _resting(sample.gesture, views[GESTURE], sample.stamp_ns)
    head = head_now(sample.pose)
    headpose = _absent(views[HEADPOSE]) or _head_witness(head, sample.pose, views[HEADPOSE], sample.stamp_ns)
    return Witnesses(None, None, gesture, head, headpose)


def in_stroke(samples: list[Sample], latest: Sample, views: Mapping[str, SourceView], config: FusionConfig) -> Witnesses:
    """A person in a stroke, or just after it: what hand and head did over it.

    A stage that is dead counts for nothing from then on. One that is only late counts by what it said a moment ago.
    """
    hand, side = hand_over(samples, config.settle_s)
    gesture = _unusable(views[GESTURE], [s.stamp_ns for s in samples], latest.stamp_ns, config)
    if gesture is not None:
        hand, side = None, None
    else:
        gesture = _hand_witness(hand, views[GESTURE], samples[-1].stamp_ns)
    posed = [s.stamp_ns for s in samples if s.pose is not None]
    head = head_over(samples, config.settle_s)
    headpose = _unusable(views[HEADPOSE], posed, latest.stamp_ns, config)
    if headpose is not None:
        head = None
    else:
        headpose = _head_witness(head, samples[-1].pose, views[HEADPOSE], posed[-1] if posed else None)
    return Witnesses(hand, side, gesture, head, headpose)


def _absent(view: SourceView) -> Witness | None:
    return None if view.status == "ok" else Witness(view.status, view.reason, view.producer, None)


def _unusable(view: SourceView, stamps: list[int], now_ns: int, config: FusionConfig) -> Witness | None:
    if view.status == "ok":
        return None
    fresh = bool(stamps) and now_ns - stamps[-1] <= config.max_evidence_age_s * 1e9
    if view.status == "late" and fresh:
        return None
    return Witness(view.status, view.reason, view.producer, None)


def _resting(gesture: Gesture | None, view: SourceView, stamp_ns: int) -> Witness:
    if gesture is None:
        return Witness("not_tracking", "the stage does not follow this person", view.producer, None)
    return Witness("ok", f"no pointing: {gesture.phase}, {gesture.gesture}", view.producer, stamp_ns)


def _hand_witness(hand: HandObservation | None, view: SourceView, stamp_ns: int) -> Witness:
    if hand is None:
        return Witness("not_tracking", "the stage does not follow this person", view.producer, None)
    bearing = ""
    if hand.bearing_deg is not None and hand.bearing_sigma_deg is not None:
        mirror = f" or {180 - hand.bearing_deg:.1f}" if hand.mirrored else ""
        bearing = f", bearing {hand.bearing_deg:.1f}{mirror} +- {hand.bearing_sigma_deg:.1f} deg"
    return Witness(view.status, f"{hand.gesture}{bearing}", view.producer, stamp_ns)


def _head_witness(head: HeadObservation | None, pose: HeadPose | None, view: SourceView, stamp_ns: int | None) -> Witness:
    if head is None:
        why = f"head {pose.status}" if pose is not None else "the stage does not follow this person"
        return Witness("not_tracking", why, view.producer, None)
    if head.yaw_deg is None:
        side = f" to the {head.side}" if head.side else ""
        return Witness(view.status, f"out of range{side}", view.producer, stamp_ns)
    return Witness(view.status, f"yaw {head.yaw_deg:.1f} +- {head.yaw_sigma_deg or 0:.1f} deg", view.producer, stamp_ns)
