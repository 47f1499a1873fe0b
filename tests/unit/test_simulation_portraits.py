import numpy as np
import pytest
from deixis_simulation.avatars import FITTING_AVATARS
from deixis_simulation.portraits import LANDMARKS, SIDE_PX, Portrait, portraits
from simulation_ready import needs_renderer

pytestmark = needs_renderer


@pytest.fixture(scope="module")
def made() -> list[Portrait]:
    return list(portraits(3, FITTING_AVATARS, 96, rooms=2))


def yaw_of(portrait: Portrait) -> float:
    return float(np.degrees(np.arctan2(-portrait.rotation[0, 2], portrait.rotation[2, 2])))


def test_where_the_nose_is_there_is_skin(made: list[Portrait]) -> None:
    """One renderer an avatar lives in this process: when the wrong one was drawn with, people wore each other's pictures."""
    redder = []
    for portrait in made:
        if abs(yaw_of(portrait)) < 60:
            x, y = np.round(portrait.landmarks_px[LANDMARKS.index("nose")]).astype(int)
            blue, _, red = portrait.picture[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3).mean(axis=0)
            redder.append(red > blue)
    assert len(redder) > 8
    assert np.mean(redder) > 0.8


def test_no_two_portraits_are_the_same(made: list[Portrait]) -> None:
    assert {portrait.picture.shape for portrait in made} == {(SIDE_PX, SIDE_PX, 3)}
    assert len({portrait.picture.tobytes() for portrait in made}) == len(made)


def test_the_same_seed_gives_the_same_portraits(made: list[Portrait]) -> None:
    again = list(portraits(3, FITTING_AVATARS, 20, rooms=2))
    for one, other in zip(made, again, strict=False):
        assert (one.rotation == other.rotation).all()
        assert np.abs(one.picture.astype(int) - other.picture).mean() < 0.5


def test_the_truth_is_a_rotation_and_the_landmarks_follow_it(made: list[Portrait]) -> None:
    """From the left eye to the right one is where the head's own left-right axis points in the picture."""
    left, right = LANDMARKS.index("left_ear"), LANDMARKS.index("right_ear")
    for portrait in made:
        assert portrait.rotation @ portrait.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
        across = portrait.landmarks_px[left] - portrait.landmarks_px[right]
        expected = portrait.rotation[:2, 0] * portrait.breadth_px
        assert np.linalg.norm(across - expected) < 0.35 * portrait.breadth_px


def test_heads_are_seen_from_all_around(made: list[Portrait]) -> None:
    yaws = [yaw_of(portrait) for portrait in made]
    assert min(yaws) < -60
    assert max(yaws) > 60
