import numpy as np
import pytest
from deixis_headpose.affine import (
    CONVERGED_PX,
    PatchMatch,
    border_weights,
    design_matrix,
    least_squares,
    match_patch,
    refusal,
    take_template,
    template_points,
    transform,
)
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_headpose.head import Pose, rotation_of
from deixis_headpose.patch import Level, pyramid
from deixis_headpose.sphere import angle_of_edges, longitude_of, projected
from deixis_schemas.messages import HeadPose
from hypothesis import given, settings
from hypothesis import strategies as st
from painted_head import LENS, face_of, painted_head, turned_to

PATCH = np.array([80.0, 24.0, 0.0, 80.0, 0.0, 30.0])
FRAME_NS = 33_333_333
GATE = 0.75

shift = st.floats(-4, 4)
stretch = st.floats(-2.5, 2.5)
changes = st.tuples(shift, stretch, stretch, shift, stretch, stretch).map(np.array)


def picture_of(patch: np.ndarray, gain: float = 1.0, offset: float = 0.0) -> np.ndarray:
    """A picture (160, 160) of a smooth pattern that a patch (6,) places in it."""
    a0, a1, a2, b0, b1, b2 = patch
    v, u = np.mgrid[0:160, 0:160]
    x, y = np.einsum("ij,jkl->ikl", np.linalg.inv([[a1, a2], [b1, b2]]), np.stack([u - a0, v - b0]))
    grey = 120 + 30 * np.sin(4 * x + 0.5) * np.cos(3 * y) + 25 * np.cos(5 * y + 2 * x) + 20 * np.sin(2 * x - 6 * y + 1)
    return np.rint(np.clip(gain * grey + offset, 0, 255)).astype(np.uint8)


def levels_of(picture: np.ndarray) -> list[Level]:
    return pyramid(picture, (80.0, 80.0), 50.0, 64.0, 3)


TEMPLATE = take_template(levels_of(picture_of(PATCH)), PATCH)


def matched(picture: np.ndarray) -> PatchMatch:
    return match_patch(levels_of(picture), TEMPLATE, PATCH)


@settings(max_examples=25, deadline=None)
@given(change=changes)
def test_a_known_warp_of_a_patch_is_found_and_accepted(change: np.ndarray) -> None:
    found = matched(picture_of(PATCH + change))
    assert found.parameters == pytest.approx(PATCH + change, abs=0.3)
    assert refusal(found, PATCH, GATE) is None


@settings(max_examples=25, deadline=None)
@given(change=changes, gain=st.floats(0.5, 1.1), offset=st.floats(-5, 25))
def test_gain_and_offset_of_the_picture_do_not_matter(change: np.ndarray, gain: float, offset: float) -> None:
    plain, other = (matched(picture_of(PATCH + change, *light)) for light in ((1.0, 0.0), (gain, offset)))
    assert other.parameters == pytest.approx(plain.parameters, abs=0.2)


@settings(max_examples=25, deadline=None)
@given(change=changes)
def test_mirrored_pictures_give_mirrored_parameters(change: np.ndarray) -> None:
    mirror = np.array([-1, 1, -1, 1, -1, 1])
    start = np.array([79.5, 24.0, 0.0, 79.5, 0.0, 30.0])  # in the very middle
    first, then = levels_of(picture_of(start)), picture_of(start + change)
    flipped = levels_of(np.fliplr(picture_of(start)))
    found = match_patch(levels_of(then), take_template(first, start), start).parameters
    mirrored = match_patch(levels_of(np.fliplr(then)), take_template(flipped, start), start).parameters
    # Either may stop so far from where the steps would end.
    assert mirrored == pytest.approx(mirror * found + np.array([159.0, 0, 0, 0, 0, 0]), abs=2 * CONVERGED_PX)


@settings(max_examples=15, deadline=None)
@given(one=changes, other=changes)
def test_a_match_by_way_of_another_frame_is_the_direct_one(one: np.ndarray, other: np.ndarray) -> None:
    between, after = PATCH + 0.5 * one, PATCH + 0.5 * one + 0.5 * other
    first = matched(picture_of(between))
    levels = levels_of(picture_of(between))
    second = match_patch(levels_of(picture_of(after)), take_template(levels, first.parameters), first.parameters)
    assert second.parameters == pytest.approx(matched(picture_of(after)).parameters, abs=0.3)


def test_the_design_matrix_is_the_derivative_of_the_grey_values_by_the_parameters() -> None:
    def grey(parameters: np.ndarray) -> np.ndarray:
        x, y = transform(parameters, points).T
        return np.sin(x / 9) + np.cos(y / 7)

    points = template_points(8)
    x, y = transform(PATCH, points).T
    design = design_matrix(np.stack([np.cos(x / 9) / 9, -np.sin(y / 7) / 7], axis=1), points)
    for k, step in enumerate(1e-5 * np.eye(6)):
        assert (grey(PATCH + step) - grey(PATCH - step)) / 2e-5 == pytest.approx(design[:, k], abs=1e-6)


def test_weights_fall_to_the_border_and_are_even_to_all_sides() -> None:
    weights = border_weights(template_points(16)).reshape(16, 16)
    assert np.all(np.diff(weights[:, :9], axis=1)[:, :7] > 0)
    assert weights[0].max() < 0.13 < weights.max()
    assert np.array_equal(weights, weights[::-1].T)


def test_a_patch_without_texture_has_no_solution() -> None:
    stripes = np.stack([np.ones(64), np.zeros(64)], axis=1)  # says nothing of a motion along y
    assert least_squares(design_matrix(stripes, template_points(8)), np.ones(64), np.ones(64)) is None
    assert refusal(matched(np.full((160, 160), 90, np.uint8)), PATCH, GATE) == "iterations"


@pytest.mark.parametrize("seed", range(8))
def test_a_patch_of_something_else_is_refused(seed: int) -> None:
    generator = np.random.default_rng(seed)
    coarse = generator.integers(0, 255, (20, 20)).astype(np.uint8)
    assert refusal(matched(np.kron(coarse, np.ones((8, 8), np.uint8))), PATCH, GATE) is not None


def path(*sizes: float) -> np.ndarray:
    return np.array(sizes)[:, None] * np.eye(6)[0]


@pytest.mark.parametrize(
    ("steps", "change", "correlation", "why"),
    [
        (path(1.0, 0.3, 0.01), 1.0, 0.9, None),
        (path(1.0, 0.8, 0.6), 1.0, 0.9, "iterations"),
        (path(), 0.0, 0.9, "iterations"),
        (path(0.02, 0.04), 1.0, 0.9, "steps grow"),
        (path(1.0, -0.9, 0.8, -0.7, 0.6, 0.01), 1.0, 0.9, "steps alternate"),
        (path(1.0, 0.3, 0.01), 20.0, 0.9, "size"),
        (path(1.0, 0.3, 0.01), 1.0, 0.7, "correlation"),
    ],
)
def test_every_criterion_of_a_match_refuses(steps: np.ndarray, change: float, correlation: float, why: str | None) -> None:
    match = PatchMatch(PATCH + change * np.eye(6)[0], steps, correlation)
    assert refusal(match, PATCH, GATE) == why


@given(longitude=st.floats(-70, 70).map(np.radians), distance=st.floats(5, 50))
def test_a_longitude_is_read_back_from_where_it_is_seen(longitude: float, distance: float) -> None:
    x = projected(np.array([longitude]), distance)
    assert longitude_of(x, distance) == pytest.approx(longitude, abs=1e-9)
    # The closed form of NOTES.md on eq. 6.
    away = np.hypot(distance - 1, x)
    assert np.arcsin(x * distance / away) - np.arctan2(x, distance - 1) == pytest.approx(longitude, abs=1e-9)


def test_beyond_the_outline_a_longitude_is_the_horizon() -> None:
    assert longitude_of(np.array([-3.0, 3.0]), 12.0) == pytest.approx(np.array([-1, 1]) * np.arccos(1 / 12))


@given(turn=st.floats(-40, 40).map(np.radians), half=st.floats(5, 35).map(np.radians))
def test_the_mean_of_two_edges_is_the_angle_of_a_patch(turn: float, half: float) -> None:
    edges = projected(np.array([turn - half, turn + half]), 15.0)
    assert angle_of_edges(edges, 15.0) == pytest.approx(turn, abs=1e-9)


def chain_of(poses: list[Pose], mirrored: bool = False) -> list[HeadPose]:
    """The answers to a painted head that looks into the camera for three frames and then moves so."""
    estimator = HeadPoseEstimator(HeadposeConfig(method="affine"))
    poses = [turned_to(0.0)] * 3 + poses
    pictures = [painted_head(pose) for pose in poses]
    if mirrored:
        pictures = [np.ascontiguousarray(picture[:, ::-1]) for picture in pictures]
    return [
        estimator.update(picture, [face_of(pose)], LENS, 1, k * FRAME_NS)[0]
        for k, (picture, pose) in enumerate(zip(pictures, poses, strict=True))
    ]


STEPS_DEG = [float(angle) for angle in np.linspace(0, 20, 11)]


@pytest.mark.parametrize("side", [-1, 1])
def test_a_turn_of_a_painted_head_is_summed_up_with_its_sign_and_a_growing_sigma(side: int) -> None:
    said = chain_of([turned_to(side * yaw) for yaw in STEPS_DEG])
    assert [pose.status for pose in said[2:]] == ["tracking"] * 12
    # It turns about its own centre, a person's about the neck, which the sphere's radius allows for: it is read short.
    assert side * said[-1].yaw_deg == pytest.approx(0.73 * 20, abs=4)
    assert said[-1].yaw_sigma_deg > said[6].yaw_sigma_deg > said[2].yaw_sigma_deg


def test_a_mirrored_turn_is_read_mirrored() -> None:
    yaws = [
        [pose.yaw_deg for pose in chain_of([turned_to(yaw) for yaw in STEPS_DEG], mirrored)[2:]] for mirrored in (False, True)
    ]
    assert yaws[1] == pytest.approx([-yaw for yaw in yaws[0]], abs=0.5)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_nod_and_a_tilt_are_read_with_their_signs(side: int) -> None:
    place = turned_to(0.0).position_m
    nod, tilt = (
        chain_of([Pose(rotation_of(0.0, *(side * np.radians(turn * step))), place) for step in STEPS_DEG])[-1]
        for turn in np.array([[0.6, 0.0], [0.0, 0.6]])
    )
    assert side * nod.pitch_deg == pytest.approx(0.73 * 12, abs=3)
    assert side * tilt.roll_deg == pytest.approx(12, abs=2)
    assert max(abs(nod.yaw_deg), abs(nod.roll_deg), abs(tilt.yaw_deg), abs(tilt.pitch_deg)) < 4


def test_a_covered_face_is_held_then_lost_and_started_anew_from_the_front() -> None:
    estimator, noise = HeadPoseEstimator(HeadposeConfig(method="affine")), np.random.default_rng(2)
    pose, stamps = turned_to(0.0), iter(range(0, 10**10, FRAME_NS))
    before = [estimator.update(painted_head(pose), [face_of(pose)], LENS, 1, next(stamps))[0] for _ in range(4)]
    unseen = face_of(pose).model_copy(update={"frontal": None})
    covered = [
        estimator.update(noise.integers(0, 255, (240, 320), dtype=np.uint8), [unseen], LENS, 1, next(stamps))[0]
        for _ in range(12)
    ]
    after = [estimator.update(painted_head(pose), [face_of(pose)], LENS, 1, next(stamps))[0] for _ in range(4)]
    assert [said.status for said in (before[-1], covered[0], covered[-1], after[-1])] == [
        "tracking",
        "tracking",
        "lost",
        "tracking",
    ]
    assert covered[0].yaw_sigma_deg > before[-1].yaw_sigma_deg + 1
    assert after[-1].yaw_deg == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("method", ["ellipsoid", "affine"])
def test_a_face_covered_for_longer_than_anything_is_known_of_it_is_lost_and_not_held(method: str) -> None:
    """Held for 3 s its sigma passed what a message can say, and the stage ended."""
    estimator = HeadPoseEstimator(HeadposeConfig.model_validate({"method": method, "hold_s": 5}))
    pose, noise = turned_to(0.0), np.random.default_rng(2)
    unseen = face_of(pose).model_copy(update={"frontal": None})
    for k in range(4):
        estimator.update(painted_head(pose), [face_of(pose)], LENS, 1, k * FRAME_NS)
    said = [
        estimator.update(noise.integers(0, 255, (240, 320), dtype=np.uint8), [unseen], LENS, 1, (4 + k) * 100_000_000)[0]
        for k in range(34)
    ]
    statuses = [head.status for head in said]
    assert statuses == ["tracking"] * statuses.count("tracking") + ["lost"] * statuses.count("lost")
    assert statuses.count("tracking") > 5
    assert statuses.count("lost") > 5


def test_a_head_turned_beyond_the_range_is_said_to_be_out_of_it_on_its_side() -> None:
    estimator = HeadPoseEstimator(HeadposeConfig(method="affine", range_deg=31.0))
    poses = [turned_to(-2.0 * max(0, k - 3)) for k in range(34)]
    said = [estimator.update(painted_head(pose), [face_of(pose)], LENS, 1, k * FRAME_NS)[0] for k, pose in enumerate(poses)]
    assert (said[-1].status, said[-1].side) == ("out_of_range", "right")
