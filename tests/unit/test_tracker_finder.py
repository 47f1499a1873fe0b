from itertools import pairwise

import cv2
import numpy as np
import pytest
from deixis_tracker.camera_motion import Shift
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import (
    BREADTH,
    HAND,
    HEAD,
    LEFT_HAND,
    RIGHT_HAND,
    STRIDE,
    USUAL_PX,
    WIDTH_PER_BREADTH,
    Finder,
    Look,
    Seen,
    Surroundings,
    apart,
    close_looks,
    whole_looks,
)
from deixis_tracker.frame import Box
from deixis_tracker.tracker import Tracker
from hypothesis import given
from hypothesis import strategies as st


@pytest.fixture(scope="module")
def finder():
    return Finder()


@pytest.fixture
def pointing(example_clip):
    """A frame of the example in which the arm is held out, and where its hand is."""
    capture, tracker = cv2.VideoCapture(str(example_clip)), Tracker(TrackerConfig())
    for k in range(75):
        picture = capture.read()[1]
        tracks = tracker.update(picture, 1, k * 33_333_333)
    return picture, min((t.centroid_px for t in tracks if t.kind.endswith("hand")), key=lambda centroid: centroid[1])


def maps_with(kind, column, row):
    """Maps whose only summit, a parabola, is at that place of the grid."""
    maps = np.full((4, 20, 24), -9.0, np.float32)
    y, x = np.mgrid[:20, :24]
    maps[kind] = 5 - 0.5 * ((x - column) ** 2 + (y - row) ** 2)
    maps[BREADTH] = 0
    return maps


@given(st.floats(2, 20), st.floats(2, 17), st.floats(0.5, 8), st.floats(0, 300), st.floats(0, 300))
def test_a_summit_between_cells_is_found_in_pixels_of_the_picture(column, row, scale, x0, y0):
    seen = Surroundings(maps_with(HEAD, column, row), x0, y0, scale).heads(0.0)[0]
    middle = (STRIDE - 1) / 2
    expected = [of + (at * STRIDE + middle + 0.5) * scale - 0.5 for at, of in ((column, x0), (row, y0))]
    assert (seen.x, seen.y) == pytest.approx(expected, abs=0.01 * STRIDE * scale)
    assert seen.width == pytest.approx(USUAL_PX * WIDTH_PER_BREADTH * scale)


def test_odds_are_read_where_a_thing_is_and_nowhere_outside():
    around = Surroundings(maps_with(LEFT_HAND, 10, 8), 50, 30, 2.0)
    hand = around.hands(LEFT_HAND, 0.0)[0]
    assert around.odds_near(LEFT_HAND, hand.x, hand.y, 4.0) == pytest.approx(5, abs=0.6)
    assert around.odds_near(LEFT_HAND, hand.x + 80, hand.y, 4.0) < -9
    assert around.odds_near(RIGHT_HAND, hand.x, hand.y, 4.0) == -9
    assert around.odds_near(LEFT_HAND, -500, 0, 4.0) == -np.inf


def test_doubt_whose_hand_it_is_is_no_doubt_that_it_is_one():
    maps = maps_with(LEFT_HAND, 10, 8)
    maps[RIGHT_HAND] = maps[LEFT_HAND]
    around = Surroundings(maps, 0, 0, 1.0)
    left, hand = around.hands(LEFT_HAND, 0.0)[0], around.hands(HAND, 0.0)[0]
    assert hand[:2] == pytest.approx(left[:2], abs=0.5)
    assert hand.odds == pytest.approx(left.odds + np.log(2), abs=1e-3)
    assert around.moved(Shift.none()).hands(HAND, 0.0)[0].odds == pytest.approx(hand.odds)


def test_of_heads_on_one_another_the_best_is_kept():
    best, other, away = Seen(100, 100, 3, 40), Seen(110, 104, 2, 50), Seen(160, 100, 1, 40)
    assert apart([other, best, away]) == [best, away]


@pytest.mark.parametrize("size", [(32, 32), (240, 320), (480, 640), (640, 360)])
def test_scales_of_a_search_are_octaves_down_to_the_smallest_picture_that_shows_a_head(size):
    looks = whole_looks(*size)
    assert looks[0].scale >= 1
    assert max(size) / looks[0].scale <= 320
    assert all(b.scale == 2 * a.scale for a, b in pairwise(looks))
    assert {look.part for look in looks} == {(0, 0, size[1], size[0])}


@pytest.mark.parametrize("size", [(480, 640), (240, 320)])
def test_a_picture_that_is_the_frame_is_searched_whole_alone_up_to_vga(size):
    assert close_looks(*size, 1.0, 8) == []


@pytest.mark.parametrize(
    ("size", "frame_scale", "scales"),
    [((360, 640), 3.0, [1]), ((480, 640), 1.6, [1]), ((720, 1280), 1.0, [2]), ((720, 1280), 1.5, [2, 1])],
)
def test_parts_of_a_large_picture_are_searched_too(size, frame_scale, scales):
    height, width = size
    looks = close_looks(height, width, frame_scale, 8)
    assert list(dict.fromkeys(look.scale for look in looks)) == scales
    for scale in scales:
        covered = np.zeros(size, np.uint8)
        for part, _ in (look for look in looks if look.scale == scale):
            assert max(part.w, part.h) / scale <= 321
            covered[part.window(*size)] += 1
        assert covered.min() == 1
        assert (covered > 1).any()


def test_heads_that_are_wide_enough_are_not_looked_for_closely():
    assert close_looks(360, 640, 3.0, 40) == []


def seen_in(finder, picture, hand):
    """The surest head, and the log odds of a hand of either side at that place."""
    head = max((h for look in whole_looks(480, 640) for h in finder.over(picture, look).heads(0.0)), key=lambda h: h.odds)
    around = finder.around(picture, head.x, head.y, head.width)
    return head, max(around.odds_near(kind, *hand, 0.4 * head.width) for kind in (RIGHT_HAND, LEFT_HAND))


def test_head_and_hand_are_found_without_colour(finder, pointing):
    picture, hand = pointing
    grey = cv2.cvtColor(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    (head, odds), (grey_head, grey_odds) = seen_in(finder, picture, hand), seen_in(finder, grey, hand)
    assert (grey_head.x, grey_head.y) == pytest.approx((head.x, head.y), abs=0.2 * head.width)
    assert grey_head.width == pytest.approx(head.width, rel=0.2)
    assert odds > 0.5
    assert grey_odds > -0.5


def test_the_mirror_changes_nothing_but_the_side(finder, pointing):
    picture, (x, y) = pointing
    last = picture.shape[1] - 1
    (head, _), (mirrored, odds) = (
        seen_in(finder, picture, (x, y)),
        seen_in(finder, np.ascontiguousarray(picture[:, ::-1]), (last - x, y)),
    )
    assert last - mirrored.x == pytest.approx(head.x, abs=0.2 * head.width)
    assert odds > 0


def test_a_wall_has_no_head(finder):
    wall = np.full((240, 320, 3), (120, 150, 190), np.uint8)
    assert finder.over(wall, Look(Box(0, 0, 320, 240), 1.0)).heads(0.0) == []


@pytest.mark.parametrize("place", [(5000, 100), (100, 5000), (-5000, 100), (100, -5000)])
def test_around_a_head_predicted_far_outside_there_is_nothing_to_fail_on(finder, place):
    assert finder.around(np.full((240, 320, 3), 90, np.uint8), *place, 40.0).heads(0.5) == []
