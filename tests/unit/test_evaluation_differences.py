"""The comparison with references can fail: on what, by how much, and in what words."""

from collections.abc import Callable, Sequence
from typing import Any

import pytest
from deixis_evaluation.differences import differences
from deixis_schemas.messages import Belief, Gestures, HeadPoses, Message, OfFrame, Target, Tracks

FRAMES = 100


def head(seq: int) -> dict[str, Any]:
    return {"run": 1, "seq": seq, "stamp_ns": 10**18 + seq * 33_333_333, "stage": "test", "instance": "t"}


def tracks(seq: int, **changes: Any) -> Tracks:
    face = {"track_id": 3, "person_id": 0, "kind": "face", "kind_probabilities": {}, "centroid_px": (120, 110)}
    face |= {"bbox_px": (100, 80, 40, 60), "velocity_px_s": (0, 0)}
    return Tracks.model_validate({**head(seq), "width": 640, "height": 480, "tracks": [face | changes]})


def poses(seq: int, **changes: Any) -> HeadPoses:
    pose = {"person_id": 0, "status": "tracking", "yaw_deg": 179.5, "yaw_sigma_deg": 4}
    return HeadPoses.model_validate({**head(seq), "poses": [pose | changes]})


def gestures(seq: int, **changes: Any) -> Gestures:
    gesture = {"person_id": 0, "phase": "stroke", "gesture": "point_left", "hand": "left", "bearing_deg": 60}
    return Gestures.model_validate({**head(seq), "gestures": [gesture | {"bearing_sigma_deg": 8} | changes]})


def belief(seq: int, pignistic: float = 0.8, probability: float = 0.9) -> Belief:
    poi = {
        "poi_id": "P3",
        "mass": 0.7,
        "belief": 0.7,
        "plausibility": 0.9,
        "pignistic": pignistic,
        "probability": probability,
    }
    return Belief.model_validate({**head(seq), "persons": [{"person_id": 0, "distance_m": 2.0, "unknown": 0.1, "pois": [poi]}]})


def target(*poi_ids: str, ended: int = 70, final: bool = True) -> Target:
    content = {"episode_id": "e", "person_id": 0, "final": final, "poi_ids": list(poi_ids), "conflict": 0, "reason": ""}
    times = {"started_ns": head(30)["stamp_ns"], "ended_ns": head(ended)["stamp_ns"], "latency_ms": 0}
    return Target.model_validate({**head(ended), **content, **times})


def clip(make: Callable[..., OfFrame], changed: Sequence[int] = (), **changes: Any) -> list[Message]:
    """A message for each frame, other ones in the frames `changed`."""
    return [make(seq, **(changes if seq in changed else {})) for seq in range(FRAMES)]


def fields(stage: str, old: Sequence[Message], new: Sequence[Message]) -> list[str]:
    return [item.tolerance.field for item in differences(stage, old, new)]


@pytest.mark.parametrize(
    ("stage", "make"), [("tracker", tracks), ("headpose", poses), ("gesture", gestures), ("fusion", belief)]
)
def test_equal_answers_differ_in_nothing(stage: str, make: Callable[..., OfFrame]) -> None:
    assert differences(stage, clip(make), clip(make)) == []


@pytest.mark.parametrize(
    ("stage", "make", "changes", "field"),
    [
        ("tracker", tracks, {"bbox_px": (103, 80, 40, 60)}, "centre_px"),
        ("tracker", tracks, {"bbox_px": (98.5, 80, 43, 60)}, "size_px"),
        ("tracker", tracks, {"kind": "left_hand"}, "tracks"),
        ("tracker", tracks, {"person_id": 1}, "tracks"),
        ("tracker", tracks, {"frontal": {"centre_px": (120, 110), "width_px": 40}}, "frontal"),
        ("headpose", poses, {"yaw_deg": 177}, "yaw_deg"),
        ("headpose", poses, {"status": "lost", "yaw_deg": None}, "status"),
        ("headpose", poses, {"yaw_sigma_deg": 6}, "yaw_sigma_deg"),
        ("gesture", gestures, {"gesture": "point_right"}, "gesture"),
        ("gesture", gestures, {"phase": "preparation"}, "phase"),
        ("gesture", gestures, {"hand": "right"}, "hand"),
        ("gesture", gestures, {"bearing_deg": 64}, "bearing_deg"),
        ("fusion", belief, {"pignistic": 0.76}, "pignistic"),
        ("fusion", belief, {"probability": 0.86}, "probability"),
    ],
)
def test_each_field_has_a_limit(stage: str, make: Callable[..., OfFrame], changes: dict[str, Any], field: str) -> None:
    assert fields(stage, clip(make), clip(make, range(FRAMES), **changes)) == [field]


@pytest.mark.parametrize(
    ("stage", "make", "changes"),
    [
        ("tracker", tracks, {"bbox_px": (101, 80, 40, 61), "track_id": 8}),
        ("headpose", poses, {"yaw_deg": -179.5}),  # 1 degree further, across the back
        ("gesture", gestures, {"bearing_deg": 62}),
        ("fusion", belief, {"pignistic": 0.82}),
    ],
)
def test_what_no_one_would_notice_is_let_pass(stage: str, make: Callable[..., OfFrame], changes: dict[str, Any]) -> None:
    assert differences(stage, clip(make), clip(make, range(FRAMES), **changes)) == []


def test_a_state_may_change_a_few_frames_later_and_not_more() -> None:
    assert differences("gesture", clip(gestures), clip(gestures, range(50, 53), phase="idle")) == []
    assert fields("gesture", clip(gestures), clip(gestures, range(50, 54), phase="idle")) == ["phase"]


def test_a_frame_without_an_answer_is_a_difference_on_either_side() -> None:
    assert fields("headpose", clip(poses), clip(poses)[:-1]) == ["frames"]
    assert fields("headpose", clip(poses)[1:], clip(poses)) == ["frames"]
    assert fields("headpose", clip(poses), []) == ["frames"]


def test_another_answer_is_a_difference_however_small_the_rest() -> None:
    beliefs = clip(belief)
    assert fields("fusion", [*beliefs, target("P3")], [*beliefs, target("P3")]) == []
    assert fields("fusion", [*beliefs, target("P3")], [*beliefs, target("P3", "P4")]) == ["answers"]
    assert fields("fusion", [*beliefs, target("P3")], [*beliefs, target("P3", final=False)]) == ["answers"]
    assert fields("fusion", [*beliefs, target("P3")], [*beliefs, target("P3", ended=76)]) == ["answer_from_to_s"]


def test_a_difference_says_stage_field_frames_and_both_values() -> None:
    (found,) = differences("gesture", clip(gestures), clip(gestures, range(40, 52), gesture="point_right"))
    assert str(found) == (
        "gesture: gesture differs in 12 of 100 frames (3 allowed), first in frame 40: "
        "person 0 was 'point_left', is 'point_right'"
    )
    (found,) = differences("tracker", clip(tracks), clip(tracks, range(FRAMES), bbox_px=(103, 80, 40, 60)))
    assert str(found) == (
        "tracker: centre_px differs by more than 2 in 100 of 100 frames (2 allowed), first in frame 0: "
        "face of person 0 was (120.0, 110.0), is (123.0, 110.0)"
    )
