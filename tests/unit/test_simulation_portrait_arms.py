import numpy as np
from deixis_simulation.arms import hanging_arm
from deixis_simulation.avatars import FITTING_AVATARS, load_avatar
from deixis_simulation.body import fit_body
from deixis_simulation.portrait_arms import AROUND_DEG, direction_of, raised_arm
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


def test_a_bearing_is_positive_to_the_persons_left_and_up() -> None:
    assert np.allclose(direction_of(np.array([90.0, 0.0])), (1, 0, 0), atol=1e-9)
    assert direction_of(np.array([0.0, 30.0]))[1] > 0.4
