import cv2
import numpy as np
from deixis_tracker.growth import farthest, within
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

SQUARE, CROSS = np.ones((3, 3), np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))


@st.composite
def masks_and_seeds(draw):
    mask = draw(arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=14), elements=st.sampled_from([0, 1, 1])))
    x, y = (draw(st.integers(0, side - 1)) for side in mask.shape[::-1])
    mask[y, x] = 1
    return mask, (x, y)


def rings(mask, seed):
    """What is reached at each step, by dilating pictures."""
    reached = np.zeros_like(mask)
    reached[seed[1], seed[0]] = 1
    yield reached
    step = 1
    while True:
        grown = cv2.dilate(reached, SQUARE if step % 2 else CROSS) & mask
        if np.array_equal(grown, reached):
            return
        yield grown
        reached, step = grown, step + 1


@given(masks_and_seeds())
def test_what_is_reached_is_what_dilation_reaches(case):
    mask, seed = case
    reached = list(rings(mask, seed))
    for steps, expected in enumerate([*reached, reached[-1]]):
        assert np.array_equal(within(mask, seed, steps), expected)


@given(masks_and_seeds())
def test_the_farthest_pixel_is_the_first_of_those_reached_last(case):
    mask, seed = case
    reached = list(rings(mask, seed))
    last = reached[-1] - (reached[-2] if len(reached) > 1 else 0)
    rows, columns = np.nonzero(last)
    assert farthest(mask, seed) == ((columns[0], rows[0]), len(reached) - 1)


def test_ways_go_around_the_elbow():
    bent = np.zeros((80, 80), np.uint8)
    bent[70:80] = 1
    bent[:, 70:80] = 1
    (x, y), steps = farthest(bent, (0, 75))
    assert (x >= 70, y) == (True, 0)
    assert steps > np.hypot(75, 75) * 1.15
    assert not within(bent, (0, 75), 60)[:20].any()
