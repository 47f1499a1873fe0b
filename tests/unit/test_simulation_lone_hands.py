"""Outlines of hands of any shape, that hand postures are fitted on."""

import cv2
import numpy as np
import pytest
from deixis_simulation.avatars import HELD_OUT_AVATARS
from deixis_simulation.hand_shapes import FIST
from deixis_simulation.lone_hands import PX_PER_FACE, SHAPES, drawn_shape, lone_hands


def test_the_same_seed_draws_the_same_hands() -> None:
    one, other, third = (list(lone_hands(seed, HELD_OUT_AVATARS, 8)) for seed in (5, 5, 6))
    assert [hand.shape for hand in one] == [hand.shape for hand in other]
    assert all(np.array_equal(a.mask, b.mask) for a, b in zip(one, other, strict=True))
    assert not all(np.array_equal(a.mask, b.mask) for a, b in zip(one, third, strict=True))


def test_a_hand_is_one_piece_without_holes_about_as_large_as_hands_are() -> None:
    for hand in lone_hands(3, HELD_OUT_AVATARS, 24):
        pieces, _, sizes, _ = cv2.connectedComponentsWithStats(hand.mask, connectivity=8)
        assert pieces >= 2
        assert sizes[1:, cv2.CC_STAT_AREA].max() > 0.98 * hand.mask.sum()
        assert 0.1 < hand.mask.sum() / PX_PER_FACE**2 < 1.8  # square face widths, with some of the forearm
        assert np.hypot(*hand.along) == pytest.approx(1)


def test_stretched_fingers_are_ahead_of_the_palm_where_the_forearm_points_to() -> None:
    ahead = []
    for hand in lone_hands(4, HELD_OUT_AVATARS, 200):
        if hand.shape == "open":
            depth = cv2.distanceTransform(np.pad(hand.mask, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
            row, column = np.unravel_index(np.argmax(depth), depth.shape)
            rows, columns = np.nonzero(hand.mask)
            ahead.append(((columns - column) * hand.along[0] + (rows - row) * hand.along[1]).max() / depth.max())
    assert len(ahead) >= 12
    assert np.mean(np.array(ahead) > 1.5) > 0.8


@pytest.mark.parametrize(("shape", "bent"), [("index", 3), ("open", 0), ("fist", 4), ("thumb", 4)])
def test_a_named_shape_folds_as_many_fingers_as_its_name_says(shape, bent) -> None:
    rng = np.random.default_rng(1)
    for _ in range(30):
        folded = drawn_shape(shape, rng).bend[:, 1] / FIST.bend[:, 1]
        assert np.sum(folded > 0.5) == bent
        assert shape != "index" or folded[0] < 0.5


def test_other_hands_are_none_of_those_with_a_name() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        drawn = drawn_shape("other", rng)
        stretched = drawn.bend[:, 1] / FIST.bend[:, 1] < 0.25
        assert stretched.sum() < 4
        folded = drawn.bend[1:, 1] / FIST.bend[1:, 1] > 0.7
        if stretched.tolist() == [True, False, False, False] and folded.all():
            assert drawn.thumb[0] < -2  # stretched aside: an L
    assert set(SHAPES) >= {"index", "other"}
