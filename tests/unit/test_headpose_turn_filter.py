import numpy as np
import pytest
from deixis_headpose.turn_filter import Motion, TurnFilter
from hypothesis import given
from hypothesis import strategies as st

STEP_S = 1 / 30
SIGMA_DEG = 4.0
LOOK = np.full(3, SIGMA_DEG**2)
angle = st.floats(-179, 179)


def followed(yaws_deg: np.ndarray, step_s: float = STEP_S) -> np.ndarray:
    """What the filter says of these yaws, look by look."""
    turn = TurnFilter(np.array([yaws_deg[0], 0.0, 0.0]), LOOK, Motion())
    said = [turn.angles_deg[0]]
    for yaw in yaws_deg[1:]:
        turn.predict(step_s)
        turn.update(np.array([yaw, 0.0, 0.0]), LOOK)
        said.append(turn.angles_deg[0])
    return np.array(said)


def test_a_resting_head_is_told_better_than_single_looks_tell_it() -> None:
    looks = 20 + SIGMA_DEG * np.random.default_rng(1).standard_normal(300)
    said = followed(looks)[30:]
    assert np.std(said) < 0.45 * SIGMA_DEG
    assert abs(said.mean() - 20) < 1.0


def test_a_fast_turn_is_followed_within_a_tenth_of_a_second() -> None:
    times = np.arange(0, 2, STEP_S)
    truth = np.clip((times - 0.5) * 300, 0, 90)
    late = np.abs(followed(truth) - truth)
    assert late.max() < 300 * 0.1
    assert late[times > 1.0].max() < 4.0


@pytest.mark.parametrize("rate_hz", [10, 60])
def test_the_rate_of_frames_does_not_matter(rate_hz: float) -> None:
    times = np.arange(0, 2, 1 / rate_hz)
    truth = np.clip((times - 0.5) * 120, 0, 60)
    late = np.abs(followed(truth, 1 / rate_hz) - truth)
    assert late.max() < 120 * 0.15
    assert late[-1] < 1.0


def test_a_turn_through_the_back_does_not_jump_round() -> None:
    truth = 150 + np.arange(0, 60, 2.0)
    wrapped = (truth + 180) % 360 - 180
    error = (followed(wrapped) - wrapped + 180) % 360 - 180
    assert np.abs(error).max() < 8


@given(angle, st.lists(angle, max_size=8))
def test_mirrored_looks_give_mirrored_angles(first: float, others: list[float]) -> None:
    looks = np.array([first, *others])
    apart = (followed(looks) + followed(-looks) + 180) % 360 - 180
    assert np.abs(apart).max() < 1e-6


@given(angle, st.lists(angle, max_size=8))
def test_variances_stay_positive(first: float, others: list[float]) -> None:
    turn = TurnFilter(np.array([first, 0.0, 0.0]), LOOK, Motion())
    for yaw in others:
        turn.predict(STEP_S)
        turn.update(np.array([yaw, 0.0, 0.0]), LOOK)
        assert (turn.variances_deg2 > 0).all()


def test_what_is_not_seen_becomes_less_sure() -> None:
    turn = TurnFilter(np.zeros(3), LOOK, Motion())
    before = turn.variances_deg2.copy()
    for _ in range(6):
        turn.predict(STEP_S)
    assert (turn.variances_deg2 > before).all()
