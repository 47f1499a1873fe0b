"""From the frames of a stroke, or one frame, to the evidence on a person and who says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from deixis_schemas.messages import HeadPose, SourceStatus

from .config import EpisodesConfig
from .evidence import Evidence, HandObservation, HeadObservation, Sample, Witness
from .head_evidence import head_now
from .joining import GESTURE, HEADPOSE, JoinedFrame
from .robust import weigh
from .shown import shown_over
from .views import last_place, parts_of, views_of

StageStatus = tuple[SourceStatus, str]

NO_ANSWER: StageStatus = ("late", "did not answer this frame in time")
UNKNOWN_PERSON = "the stage does not follow this person"


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
    posed = next((sample for sample in reversed(stroke) if sample.pose is not None), None)
    frames, place = weigh(stroke, config.settle_s), last_place(stroke)
    axis_deg = place.axis_deg if place is not None else None
    parts = parts_of(frames)
    hand, head = shown_over(frames, axis_deg, with_curve=not parts)
    if _counts(gesture, stroke[-1], latest, config):
        gesture = _hand_witness(hand, gesture, stroke[-1].stamp_ns)
    else:
        hand = None
    if _counts(headpose, posed, latest, config):
        headpose = _head_witness(head, stroke[-1].pose, headpose, posed.stamp_ns if posed else None)
    else:
        head = None
    return Evidence(hand, gesture, head, headpose, views_of(parts, hand, head))


def _counts(stage: Witness, told: Sample | None, latest: Sample, config: EpisodesConfig) -> bool:
    """Whether a stage counts that told something last in `told`."""
    if stage.status == "late":
        return told is not None and latest.at_ns - told.at_ns <= config.max_evidence_age_s * 1e9
    return stage.status == "ok"


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
    if hand.elevation_deg is not None and hand.elevation_sigma_deg is not None:
        bearing += f", elevation {hand.elevation_deg:.1f} +- {hand.elevation_sigma_deg:.1f} deg"
    return Witness(stage.status, f"{hand.gesture}{bearing}", stage.producer, stamp_ns)


def _head_witness(head: HeadObservation | None, pose: HeadPose | None, stage: Witness, stamp_ns: int | None) -> Witness:
    if head is None:
        why = f"head {pose.status}" if pose is not None else UNKNOWN_PERSON
        return Witness("not_tracking", why, stage.producer)
    if head.yaw_deg is None:
        side = f" to the {head.side}" if head.side else ""
        return Witness(stage.status, f"out of range{side}", stage.producer, stamp_ns)
    observed = f"yaw {head.yaw_deg:.1f} +- {head.yaw_sigma_deg or 0:.1f} deg"
    if head.pitch_deg is not None:
        observed += f", pitch {head.pitch_deg:.1f} +- {head.pitch_sigma_deg or 0:.1f} deg"
    return Witness(stage.status, observed, stage.producer, stamp_ns)
