"""How high hand and head go: which of two shelves, one above the other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from deixis_fusion.config import FusionConfig
from deixis_fusion.decision import Judgement
from deixis_fusion.deixis_rules import DeixisRules
from deixis_fusion.evidence import Evidence, HandObservation, HeadObservation, Sample, Witness
from deixis_fusion.frames import Frames
from deixis_fusion.height import Heights, elevation_of_head, head_likelihoods
from deixis_fusion.localisation import PersonPlace
from deixis_fusion.shown import shown_over
from deixis_fusion.sight import Lookout, Points
from deixis_fusion.visibility import Walls
from deixis_headpose.head import Pose, rotation_of
from deixis_runtime.mount import to_base
from deixis_schemas.messages import CameraMount, Gesture, HeadPose, Poi
from hypothesis import given
from hypothesis import strategies as st

CONFIG = FusionConfig()
SAID = Witness("ok", "")
# 2 m ahead of the camera, which stands lower than the head.
PLACE = PersonPlace((2.0, 0.0, 1.6), (0.0, 0.0, 1.2), math.hypot(2.0, 0.4), 0.2)


@given(st.floats(-80, 80), st.floats(-40, 40), st.floats(-15, 15), st.floats(-8, 8), st.floats(-0.3, 0.3), st.floats(-0.4, 0.2))
def test_the_heads_elevation_is_that_of_its_nose_whichever_way_the_camera_is_mounted(
    yaw: float, pitch: float, roll: float, up: float, aside: float, below: float
) -> None:
    mount = CameraMount(position_m=(0.0, 0.0, 1.3), roll_deg=roll, pitch_up_deg=up)
    pose = Pose(rotation_of(math.radians(yaw), math.radians(pitch)), np.array([2 * aside, below, 2.0]))
    nose = to_base(tuple(float(v) for v in pose.rotation @ [0.0, 0.0, -1.0]), mount)
    x, y, z = to_base((2 * aside, below, 2.0), mount)
    place = PersonPlace((x, y, z + 1.3), mount.position_m, 2.0, 0.2, camera_roll_deg=roll)
    seen_yaw, seen_pitch, _ = pose.angles_deg()
    found = elevation_of_head(HeadObservation(seen_yaw, 3, pitch_deg=seen_pitch, pitch_sigma_deg=3), place)
    # What is up for a camera that is tilted is not quite up for the line from it to somebody aside.
    assert found == pytest.approx(math.degrees(math.asin(max(-1.0, min(1.0, nose[2])))), abs=5)


def shelf(*heights: float, aside: float = -1.5) -> list[Poi]:
    return [Poi(poi_id=f"z{height:g}", position_m=(2.0, aside, height), extent_m=0.3) for height in heights]


ASIDE = Poi(poi_id="aside", position_m=(0.5, 1.5, 1.6))


def judge(
    pois: list[Poi], pitch: float | None, sigma: float | None, yaw: float = 90.0, raised: tuple[float, float] | None = None
) -> Judgement:
    """`raised`: elevation of the hand and its sigma."""
    elevation, spread = raised or (None, None)
    hand = HandObservation("point_left", 90.0, 10.0, elevation_deg=elevation, elevation_sigma_deg=spread)
    seen = Lookout(0.15).look(PLACE, Points.of(pois), Walls(()))
    head = HeadObservation(yaw, 4.0, pitch_deg=pitch, pitch_sigma_deg=sigma)
    rules = DeixisRules(CONFIG.hand, CONFIG.head, CONFIG.answer)
    return rules.judge(seen, Evidence(hand, SAID, head, SAID))


@pytest.mark.parametrize(("pitch", "answer"), [(-28.0, "z0.3"), (2.0, "z1.8")])
def test_a_head_that_is_lowered_or_not_tells_two_shelves_apart(pitch: float, answer: str) -> None:
    assert judge([*shelf(0.3, 1.8), ASIDE], None, None).poi_ids == ("z0.3", "z1.8")
    assert judge([*shelf(0.3, 1.8), ASIDE], pitch, 5.0).poi_ids == (answer,)


@pytest.mark.parametrize("sigma", [40.0, None])
def test_a_pitch_that_is_not_sure_or_does_not_say_how_sure_decides_nothing(sigma: float | None) -> None:
    judged = judge([*shelf(0.3, 1.8), ASIDE], -28.0, sigma)
    assert len(judged.poi_ids) == 2
    assert judged.chances[:2] == pytest.approx([0.5, 0.5], abs=0.1)


@given(st.floats(-60, 60), st.floats(1, 60))
def test_a_wrong_pitch_costs_a_poi_little_and_never_how_well_it_fits(pitch: float, sigma: float) -> None:
    pois = [*shelf(0.3, 1.8), ASIDE]
    plain, told = judge(pois, None, None), judge(pois, pitch, sigma)
    odds = np.log(told.chances / plain.chances)
    assert np.ptp(odds) < math.log(6)
    assert told.chances[2] < 0.02
    assert told.poi_ids, "a pitch lets nobody abstain"


@given(st.floats(-40, 40), st.floats(1, 30))
def test_pois_at_one_height_are_told_apart_as_before(pitch: float, sigma: float) -> None:
    one, other = (Poi(poi_id=name, position_m=(2.0 + x, -1.5, 1.4), extent_m=0.3) for name, x in (("a", -0.4), ("b", 0.4)))
    assert judge([one, other], pitch, sigma).chances == pytest.approx(judge([one, other], None, None).chances, abs=0.02)


def test_the_likelihood_is_1_where_it_fits_and_has_a_tail() -> None:
    points, extent = np.array([(2.0, -1.5, 1.6), (2.0, -1.5, -9.0)]), np.array([0.0, 0.0])
    level = HeadObservation(90.0, 3, pitch_deg=0.0, pitch_sigma_deg=3)
    high = head_likelihoods(level, PLACE, Heights.of(PLACE, points, extent), CONFIG.head)
    assert high is not None
    assert high[0] == pytest.approx(1, abs=0.02)
    assert 0.15 < high[1] < 0.3


@pytest.mark.parametrize(("elevation", "answer"), [(-38.0, "z0.3"), (6.0, "z1.8")])
def test_a_hand_that_is_lowered_or_not_tells_two_shelves_apart(elevation: float, answer: str) -> None:
    assert judge([*shelf(0.3, 1.8), ASIDE], None, None, raised=(elevation, 9.0)).poi_ids == (answer,)
    assert len(judge([*shelf(0.3, 1.8), ASIDE], None, None, raised=(elevation, 60.0)).poi_ids) == 2


@given(st.floats(-60, 60), st.floats(1, 60))
def test_a_wrong_elevation_lets_nobody_abstain_nor_mean_what_is_elsewhere(elevation: float, sigma: float) -> None:
    told = judge([*shelf(0.3, 1.8), ASIDE], None, None, raised=(elevation, sigma))
    assert told.poi_ids
    assert told.chances[2] < 0.1


def test_over_a_stroke_the_elevation_is_the_median_of_the_frames_that_tell_it() -> None:
    said = {"person_id": 1, "phase": "stroke", "gesture": "point_left", "bearing_deg": 60.0, "bearing_sigma_deg": 9.0}
    frames = [said | {"elevation_deg": high, "elevation_sigma_deg": 8.0} for high in (-20.0, -20.0, -20.0, 50.0)]
    samples = [Sample(i, i, Gesture.model_validate(frame), None) for i, frame in enumerate([*frames, said])]
    told, silent = shown_over(Frames.of(samples)).hand, shown_over(Frames.of(samples[-1:])).hand
    assert told is not None
    assert silent is not None
    assert (told.elevation_deg, told.elevation_sigma_deg) == (-20.0, 8.0)
    assert silent.elevation_deg is None


def pose(pitch: float | None, variance: float | None) -> HeadPose:
    covariance = (9.0, 0.0, 0.0, variance, 0.0, 4.0) if variance else None
    said = {"person_id": 1, "status": "tracking", "yaw_deg": 60.0, "yaw_sigma_deg": 3.0, "pitch_deg": pitch}
    return HeadPose.model_validate(said | {"covariance_deg2": covariance})


def test_over_a_stroke_the_pitch_is_the_median_and_needs_its_sigma_in_most_frames() -> None:
    def over(*poses: HeadPose) -> HeadObservation:
        head = shown_over(Frames.of([Sample(i, i, None, shown) for i, shown in enumerate(poses)])).head
        assert head is not None
        return head

    told = over(*[pose(-20.0, 25.0)] * 9, pose(50.0, 25.0))
    assert (told.pitch_deg, told.pitch_sigma_deg) == (-20.0, 5.0)
    assert over(*[pose(-20.0, None)] * 6, *[pose(-20.0, 25.0)] * 4).pitch_deg is None
    assert over(*[pose(None, None)] * 6).pitch_deg is None
