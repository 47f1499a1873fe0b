import numpy as np
import pytest
from deixis_simulation.avatars import FITTING_AVATARS
from deixis_simulation.figures import HEAD_PX, SIDE_PX, Figure, figures
from simulation_ready import needs_renderer

pytestmark = needs_renderer


@pytest.fixture(scope="module")
def made() -> list[Figure]:
    return list(figures(3, FITTING_AVATARS, 24, rooms=1))


def test_heads_are_of_the_sizes_asked_for_and_mostly_seen(made: list[Figure]) -> None:
    nearest = [figure.people[0] for figure in made]
    assert all(HEAD_PX[0] * 0.99 <= truth.breadth_px <= HEAD_PX[1] * 1.01 for truth in nearest)
    assert np.mean([truth.seen > 0.5 for truth in nearest]) > 0.7


def test_a_hand_that_is_seen_lies_in_the_picture_within_reach_of_its_head(made: list[Figure]) -> None:
    reaches = []
    for truth in (truth for figure in made for truth in figure.people):
        for hand, area in zip(truth.hands_px, truth.hand_areas_px, strict=True):
            if area:
                assert np.all((hand >= 0) & (hand < SIDE_PX))
                reaches.append(float(np.hypot(*(hand - truth.centre_px))) / truth.breadth_px)
    assert len(reaches) > 10
    assert 1 < np.median(reaches) < 4
    assert max(reaches) < 7


def test_who_stands_behind_shows_less(made: list[Figure]) -> None:
    behind = [figure.people[1] for figure in made if len(figure.people) > 1]
    assert behind
    assert np.mean([truth.seen for truth in behind]) < 1


def test_the_same_seed_gives_the_same_figures(made: list[Figure]) -> None:
    again = next(figures(3, FITTING_AVATARS, 24, rooms=1))
    assert np.array_equal(again.picture, made[0].picture)
