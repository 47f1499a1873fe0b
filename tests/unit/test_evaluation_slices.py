from pathlib import Path
from typing import Any

import pytest
from deixis_evaluation.clip_score import ClipScore
from deixis_evaluation.clips import Clip, Truth
from deixis_evaluation.episode_scores import EpisodeScore, EpisodeScores, Outcome
from deixis_evaluation.slices import slices_of
from deixis_evaluation.wilson import wilson
from hypothesis import given
from hypothesis import strategies as st
from labelled_views import STANDING

HAND = {"center_px": [300, 400], "visible_px": 400, "in_frame": True}


def clip(name: str, distance_m: float = 2.0, tone: float | None = None, **action: Any) -> Clip:
    """A clip of 60 frames at 30 a second; its person, 1.4 m tall where there is an action, points from frame 30 on."""
    person = {
        "id": 0,
        "phase": "stroke",
        "gesture": "point",
        "poi": "P1",
        "poi_azimuth_deg": 50,
        "head": {"yaw_rel_deg": 50, "center_px": [320, 200]},
        "face": {"visible_px": 900},
        "hands": {"left": HAND, "right": HAND},
        "user_pos": {"robot_xy": [distance_m, 0], "distance_m": distance_m},
    }
    meta: dict[str, Any] = {
        "kind": "point",
        "fps": 30,
        "width": 640,
        "height": 480,
        "camera": STANDING,
        "pois": [{"id": "P1", "xyz_world": [1, 1, 0]}],
        "persons": [{"id": 0, "face_ITA_deg": tone}],
    }
    if action:
        walk = {"type": "walk", "start_s": 0, "speed_m_s": 1}
        pointing = {"type": "point", "start_s": 0.5, "preparation_s": 0.5, "hold_s": 1, "retraction_s": 0.5, **action}
        meta["scene"] = {"people": [{"height_m": 1.4, "actions": [walk, pointing]}]}
    frames = [{"frame": index, "persons": [person]} for index in range(60)]
    return Clip(name, Path(f"{name}.mp4"), Truth.model_validate({"meta": meta, "frames": frames}))


def score(name: str, outcome: Outcome, azimuth_deg: float = 50.0) -> ClipScore:
    episode = EpisodeScore(
        person=0, poi="P1", azimuth_deg=azimuth_deg, frames=(30, 59), outcome=outcome, answered=True, poi_ids=(),
        target_frames=None, conflict=None, reason="", side=None, gestures={}, yaw_deg=None, true_yaw_deg=50.0, head={},
        bearing_deg=None,
    )  # fmt: skip
    return ClipScore(name, "point", "pointing", 60, answers=EpisodeScores((episode,)))


def test_strokes_are_sorted_by_what_they_differ_in_alone() -> None:
    clips = [clip("a", 1.2), clip("b", 2.0), clip("c", 3.0), clip("d", 3.1)]
    scores = [score("a", "named"), score("b", "wrong"), score("c", "missed", -95), score("d", "in_set")]
    slices = slices_of(clips, scores)
    distance = [(item.value, item.strokes, item.outcomes["named"]) for item in slices if item.trait == "distance"]
    assert distance == [("below 1.7 m", 1, 1), ("1.7 to 2.6 m", 1, 0), ("above 2.6 m", 2, 0)]
    assert [item.value for item in slices if item.trait == "azimuth"] == ["30 to 60 deg", "90 deg and more"]
    assert {item.trait for item in slices} == {"distance", "azimuth"}


def test_skin_tones_are_those_of_the_label_format() -> None:
    tones = {"a": -31.0, "b": -30.0, "c": 41.0, "d": 42.0, "e": None}
    clips = [clip(name, tone=tone) for name, tone in tones.items()]
    slices = slices_of(clips, [score(name, "named") for name in tones])
    found = {item.value: item.strokes for item in slices if item.trait == "skin"}
    assert found == {"dark": 1, "medium": 2, "light": 1}


def test_a_scene_tells_arm_hand_and_height() -> None:
    clips = [clip("a", style="bent", hand="flat"), clip("b", style="straight", hand="index"), clip("c")]
    slices = slices_of(clips, [score(name, "named") for name in "abc"])
    assert [(item.trait, item.value) for item in slices] == [
        ("arm", "bent"), ("arm", "straight"), ("hand", "flat"), ("hand", "index"),
    ]  # fmt: skip


@given(st.integers(0, 300), st.integers(0, 300))
def test_wilsons_interval_holds_the_share_and_is_one(hits: int, misses: int) -> None:
    interval = wilson(hits, hits + misses)
    if hits + misses == 0:
        assert interval is None
        return
    assert interval is not None
    low, high = interval
    assert 0 <= low <= hits / (hits + misses) + 1e-12
    assert hits / (hits + misses) - 1e-12 <= high <= 1


def test_wilsons_interval_of_known_counts() -> None:
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    # Newcombe 1998, table I: 81 of 263, 15 of 148.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(15, 148) == pytest.approx((0.0624, 0.1605), abs=1e-4)
    with pytest.raises(ValueError, match="3 of 2"):
        wilson(3, 2)
