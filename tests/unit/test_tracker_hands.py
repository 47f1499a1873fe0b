import cv2
import numpy as np
import pytest
from deixis_tracker.hands import cut_hand, outline

WIDTH = 60.0


def arm(length=200, thickness=24):
    mask = np.zeros((thickness, length), np.uint8)
    mask[2:-2] = 1
    return mask


def test_the_hand_is_the_end_away_from_the_shoulder():
    hand = cut_hand(arm(), 100, 50, (90, 60), WIDTH, 1.0, None)
    xs = np.nonzero(hand.mask)[1] + 100
    assert xs.max() == 299
    assert xs.min() == pytest.approx(299 - WIDTH, abs=0.12 * WIDTH)
    assert hand.centroid[0] == pytest.approx(xs.mean(), abs=0.01)


def test_a_tracked_hand_at_the_near_end_of_a_raised_forearm_stays_there():
    hand = cut_hand(arm(), 100, 50, (20, 60), WIDTH, 1.0, (125, 61))
    assert hand.centroid[0] < 160


def test_an_upper_arm_is_no_hand_even_where_one_was_expected():
    hand = cut_hand(arm(), 100, 50, (95, 60), WIDTH, 1.0, (125, 61))
    assert hand.centroid[0] > 240


def test_the_outline_is_the_border_of_the_hand_pixel_by_pixel():
    mask = np.zeros((40, 40), np.uint8)
    cv2.circle(mask, (20, 20), 15, 1, -1)
    hand = cut_hand(mask, 7, 9, (0, 0), WIDTH, 1.0, None)
    filled = np.zeros((60, 60), np.uint8)
    cv2.drawContours(filled, [outline(hand).reshape(-1, 1, 2)], -1, 1, -1)
    assert np.array_equal(filled[9:49, 7:47], hand.mask)
