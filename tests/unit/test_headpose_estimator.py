import numpy as np
import pytest
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.ellipsoid_head import yaw_sigma_deg
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_headpose.head import Pose
from deixis_schemas.messages import HeadPose, KindProbabilities, Track
from hypothesis import given
from hypothesis import strategies as st
from painted_head import LENS, face_of, painted_head, turned_to
from pydantic import ValidationError

GREY = np.full((240, 320), 90, np.uint8)
FRAME_NS = 33_333_333
LONG_TURN_DEG = 30.0


def face(person: int, x: float, width: float) -> Track:
    return Track(
        track_id=person,
        person_id=person,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(x + width / 2, 100 + width / 2),
        bbox_px=(x, 100, width, width),
        velocity_px_s=(0, 0),
    )


def a_turn(rate_hz: float) -> list[tuple[float, Pose]]:
    """Times and poses of a head that looks into the camera for 0.3 s, turns in 1 s, and stays there."""
    times = [i / rate_hz for i in range(int(1.8 * rate_hz))]
    return [(t, turned_to(LONG_TURN_DEG * min(1.0, max(0.0, t - 0.3)))) for t in times]


def answers(poses: list[Pose], stamps_ns: list[int], runs: list[int] | None = None) -> list[HeadPose]:
    estimator = HeadPoseEstimator(HeadposeConfig(method="ellipsoid"))
    runs = runs or [1] * len(poses)
    return [
        estimator.update(painted_head(pose), [face_of(pose)], LENS, run, stamp)[0]
        for pose, stamp, run in zip(poses, stamps_ns, runs, strict=True)
    ]


def test_a_picture_without_persons_gives_no_heads() -> None:
    assert HeadPoseEstimator(HeadposeConfig(method="ellipsoid")).update(GREY, [], LENS, 1, 0) == []


def test_a_face_that_is_never_seen_from_the_front_stays_initialising() -> None:
    estimator = HeadPoseEstimator(HeadposeConfig(method="ellipsoid"))
    statuses = {estimator.update(GREY, [face(4, 100, 50)], LENS, 1, k)[0].status for k in range(8)}
    assert statuses == {"initialising"}


def test_only_the_largest_heads_are_estimated() -> None:
    estimator = HeadPoseEstimator(HeadposeConfig(method="ellipsoid", max_persons=2))
    poses = estimator.update(GREY, [face(1, 10, 30), face(2, 100, 60), face(3, 200, 45)], LENS, 1, 0)
    assert [pose.person_id for pose in poses] == [2, 3]


def test_a_face_at_the_edge_of_the_picture_is_no_error() -> None:
    poses = [turned_to(0.0, (x, 0.0, 2.0)) for x in (0.57, 0.57, 0.57, 0.58, 0.59)]
    assert {pose.person_id for pose in answers(poses, [k * FRAME_NS for k in range(5)])} == {0}


def test_a_head_starts_when_several_sightings_from_the_front_agree_and_looks_into_the_camera_then() -> None:
    said = answers([turned_to(0.0)] * 4, [k * FRAME_NS for k in range(4)])
    assert [pose.status for pose in said] == ["initialising", "initialising", "tracking", "tracking"]
    assert said[-1].yaw_deg == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("rate_hz", [12, 30, 60])
def test_a_turn_is_followed_at_any_frame_rate(rate_hz: float) -> None:
    turn = a_turn(rate_hz)
    said = answers([pose for _, pose in turn], [round(t * 1e9) for t, _ in turn])
    assert said[-1].yaw_deg == pytest.approx(LONG_TURN_DEG, abs=3.0)


def test_a_clock_set_back_by_40_ms_keeps_head_and_keyframes() -> None:
    poses = [pose for _, pose in a_turn(30)]
    steady = [k * FRAME_NS + 10**18 for k in range(len(poses))]
    back = [stamp - (40_000_000 if k >= 40 else 0) for k, stamp in enumerate(steady)]
    before, after = answers(poses, steady), answers(poses, back)
    assert {pose.status for pose in after[2:]} == {"tracking"}
    # Started anew there, the head would be taken to look into the camera, or stay unseen for want of a sighting.
    assert [pose.yaw_deg for pose in after[2:]] == pytest.approx([pose.yaw_deg for pose in before[2:]], abs=0.5)


def test_another_run_of_the_camera_starts_all_heads_anew() -> None:
    said = answers([turned_to(0.0)] * 6, [k * FRAME_NS for k in range(6)], [1, 1, 1, 2, 2, 2])
    assert [pose.status for pose in said] == ["initialising", "initialising", "tracking"] * 2


def test_a_head_lost_starts_anew_where_it_is_seen_from_the_front_again() -> None:
    estimator, noise = HeadPoseEstimator(HeadposeConfig(method="ellipsoid")), np.random.default_rng(2)
    here, there = turned_to(0.0), turned_to(0.0, (0.2, 0.0, 2.0))
    stamps = iter(range(0, 10**10, FRAME_NS))
    for _ in range(4):
        estimator.update(painted_head(here), [face_of(here)], LENS, 1, next(stamps))
    unseen = face_of(here).model_copy(update={"frontal": None})
    for _ in range(12):
        rubbish = noise.integers(0, 255, (240, 320), dtype=np.uint8)
        lost = estimator.update(rubbish, [unseen], LENS, 1, next(stamps))[0]
    assert lost.status == "lost"
    for _ in range(4):
        found = estimator.update(painted_head(there), [face_of(there)], LENS, 1, next(stamps))[0]
    assert found.status == "tracking"
    assert found.yaw_deg == pytest.approx(0.0, abs=1.0)


def test_a_head_lost_while_turned_far_is_lost_and_not_out_of_range() -> None:
    estimator, noise = HeadPoseEstimator(HeadposeConfig(method="ellipsoid")), np.random.default_rng(2)
    stamps = iter(range(0, 10**11, FRAME_NS))
    for yaw in (0.0,) * 4 + tuple(np.arange(0.0, 92.0, 2.0)):
        pose = turned_to(float(yaw))
        turned = estimator.update(painted_head(pose), [face_of(pose)], LENS, 1, next(stamps))[0]
    assert turned.status == "tracking"
    assert (turned.yaw_deg or 0) > 85
    unseen = face_of(pose).model_copy(update={"frontal": None})
    for _ in range(12):
        lost = estimator.update(noise.integers(0, 255, (240, 320), dtype=np.uint8), [unseen], LENS, 1, next(stamps))[0]
    assert lost.status == "lost"


@pytest.mark.parametrize("shape", [(10, 10, 4), (10,)])
def test_a_picture_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="image: needs uint8"):
        HeadPoseEstimator(HeadposeConfig(method="ellipsoid")).update(np.zeros(shape, np.uint8), [], LENS, 1, 0)


def test_an_unknown_setting_is_refused_by_name() -> None:
    with pytest.raises(ValidationError, match="gatte"):
        HeadposeConfig.model_validate({"gatte": 0.5})


@given(yaw=st.floats(-100, 100), correlation=st.floats(0.5, 1), held=st.floats(0, 0.25))
def test_sigma_grows_with_the_turn_a_weak_match_and_holding(yaw: float, correlation: float, held: float) -> None:
    sigma = yaw_sigma_deg(yaw, correlation, held)
    assert sigma >= yaw_sigma_deg(yaw * 0.9, correlation, held)
    assert sigma <= yaw_sigma_deg(yaw, correlation - 0.1, held)
    assert sigma < yaw_sigma_deg(yaw, correlation, held + 0.1)


@given(yaw=st.floats(0, 100))
def test_sigma_is_the_same_to_both_sides(yaw: float) -> None:
    assert yaw_sigma_deg(yaw, 0.97, 0.0) == yaw_sigma_deg(-yaw, 0.97, 0.0)
