import numpy as np
from deixis_simulation.arms import hanging_arm
from deixis_simulation.avatars import FITTING_AVATARS, load_avatar
from deixis_simulation.body import fit_body
from deixis_simulation.portrait_arms import AROUND_DEG, camera_bearing, camera_elevation_deg, direction_of, raised_arm
from deixis_simulation.skeleton import SIDES, Posture, Skeleton, solve

BODY = fit_body(load_avatar(FITTING_AVATARS[1]), 1.7)
WRIST = {"right": "RightHand", "left": "LeftHand"}


def with_raised_arm(seed: int) -> tuple[Skeleton, str, np.ndarray]:
    side, arm, bearing = raised_arm(np.random.default_rng(seed), BODY)
    posture = Posture({each: hanging_arm(BODY, each) for each in SIDES})
    posture.arms[side] = arm
    return solve(BODY, posture), WRIST[side], bearing


def test_the_wrist_is_before_the_head_where_the_bearing_says() -> None:
    """As far as the arm reaches: what is behind the body it does not."""
    off_deg = []
    for seed in range(60):
        skeleton, wrist, bearing = with_raised_arm(seed)
        way = skeleton.position(wrist) - BODY.head_centre
        off_deg.append(np.degrees(np.arccos(np.clip(way @ direction_of(bearing) / np.linalg.norm(way), -1, 1))))
        assert 0.05 < np.linalg.norm(way) < 0.75
    assert np.median(off_deg) < 15


def test_both_arms_are_raised_ahead_and_aside_and_across_the_body() -> None:
    bearings = [raised_arm(np.random.default_rng(seed), BODY) for seed in range(60)]
    assert {side for side, _, _ in bearings} == set(SIDES)
    across = [bearing[0] > 0 for side, _, bearing in bearings if side == "right"]
    assert any(across)
    assert not all(across)
    assert max(abs(bearing[0]) for _, _, bearing in bearings) <= AROUND_DEG


def test_a_camera_that_shall_see_the_hand_at_the_face_stands_about_where_it_points() -> None:
    rng = np.random.default_rng(0)
    seen = np.array([camera_bearing(rng, np.array([40.0, -10.0])) for _ in range(200)])
    assert np.abs(seen.mean(axis=0) - (40, -10)).max() < 4


def test_a_bearing_is_positive_to_the_persons_left_and_up() -> None:
    assert np.allclose(direction_of(np.array([90.0, 0.0])), (1, 0, 0), atol=1e-9)
    assert direction_of(np.array([0.0, 30.0]))[1] > 0.4


def test_cameras_look_up_at_heads_more_often_than_down() -> None:
    rng = np.random.default_rng(0)
    elevations = np.array([camera_elevation_deg(rng) for _ in range(4000)])
    below, above = np.mean(elevations < -25), np.mean(elevations > 25)
    assert below > above > 0.04
    assert np.abs(elevations).max() <= 40
