"""Fingers that colour misses, found before the remembered room."""

import cv2
import numpy as np
import pytest
from deixis_tracker.fingers import with_fingers
from deixis_tracker.hands import Hand

WALL, SKIN = (150.0, 158.0, 160.0), (105.0, 130.0, 175.0)
HEAD_PX = 40.0
FIST = (90, 60, 30, 30)  # left, top, width, height
FINGER = (120, 66, 20, 4)  # at the right of the fist
SHADED = 0.7


def pictures(finger_colour=SKIN, wall=WALL, cover=1.0):
    """A fist with a finger before a wall, and the wall, at half the size."""
    room = np.full((160, 240, 3), wall, np.float32)
    seen = room.copy()
    for (x, y, w, h), colour, share in ((FIST, SKIN, 1.0), (FINGER, finger_colour, cover)):
        part = seen[y : y + h, x : x + w]
        part[:] = share * np.array(colour, np.float32) + (1 - share) * part
    noise = np.random.default_rng(0).normal(0, 2, seen.shape)
    small = cv2.resize(room, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    return np.clip(seen + noise, 0, 255).astype(np.uint8), small.astype(np.uint8)


def fist(tip=(119.0, 75.0)):
    """The outline that colour gives: it ends at the knuckles."""
    x, y, w, h = FIST
    return Hand(np.ones((h, w), np.uint8), x, y, w * h, (x + w / 2, y + h / 2), tip, 60.0)


def end_of(hand):
    """The last column of a hand."""
    return hand.x0 + int(np.flatnonzero(hand.mask.any(axis=0)).max())


def nothing_covered(room):
    return np.zeros(room.shape[:2], np.uint8)


@pytest.mark.parametrize("light", [SHADED, 1.0, 1.2])
def test_a_finger_that_colour_missed_is_found_in_any_light(light):
    seen, room = pictures(tuple(light * value for value in SKIN))
    whole = with_fingers(fist(), seen, room, nothing_covered(room), HEAD_PX)
    assert end_of(whole) == pytest.approx(139, abs=1)
    assert whole.area == pytest.approx(900 + 80, rel=0.03)


def test_a_finger_that_the_lens_blurs_ends_where_half_of_it_is_left():
    seen, room = pictures()
    seen = cv2.GaussianBlur(seen, (0, 0), 1.5)
    assert end_of(with_fingers(fist(), seen, room, nothing_covered(room), HEAD_PX)) == pytest.approx(139, abs=3)


@pytest.mark.parametrize("darker", [0.5, 0.7, 0.9])
def test_the_shadow_of_a_hand_on_the_wall_is_no_finger(darker):
    seen, room = pictures(tuple(darker * value for value in WALL))
    whole = with_fingers(fist(), seen, room, nothing_covered(room), HEAD_PX)
    assert end_of(whole) <= 121


def test_a_sleeve_of_another_colour_is_no_finger():
    seen, room = pictures((170.0, 90.0, 60.0))
    assert end_of(with_fingers(fist(), seen, room, nothing_covered(room), HEAD_PX)) <= 121


def test_the_wall_between_two_fingers_is_cut_out_though_it_passed_for_skin():
    seen, room = pictures()
    x, y, w, _ = FIST
    spread = np.s_[y + 8 : y + 14, x + w // 2 : x + w]
    seen[spread] = np.array(WALL, np.uint8)
    whole = with_fingers(fist(), seen, room, nothing_covered(room), HEAD_PX)
    assert whole.mask[y + 11 - whole.y0, x + w - 4 - whole.x0] == 0
    assert whole.mask[y + 4 - whole.y0, x + w - 4 - whole.x0] == 1


def test_a_room_that_is_remembered_as_if_the_hand_were_part_of_it_takes_nothing_away():
    seen, _ = pictures()
    room = cv2.resize(seen, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    whole = with_fingers(fist(), seen, room, nothing_covered(room), HEAD_PX)
    x, y, w, h = FIST
    assert whole.mask[y - whole.y0 :, x - whole.x0 :][:h, :w].all()


def test_where_the_room_is_not_known_nothing_is_added():
    seen, room = pictures()
    covered = np.full(room.shape[:2], 255, np.uint8)
    whole = with_fingers(fist(), seen, room, covered, HEAD_PX)
    assert (whole.area, end_of(whole)) == (900, 119)


def test_the_side_of_the_forearm_stays_cut_off():
    seen, room = pictures()
    whole = with_fingers(fist(tip=(90.0, 75.0)), seen, room, nothing_covered(room), HEAD_PX)
    assert end_of(whole) <= 120


def test_a_hand_at_the_edge_of_the_picture_is_no_error():
    seen, room = pictures()
    edge = fist()._replace(x0=210, y0=131, mask=np.ones((29, 30), np.uint8), centroid=(225.0, 145.0), tip=(239.0, 150.0))
    whole = with_fingers(edge, seen, room, nothing_covered(room), HEAD_PX)
    assert whole.x0 + whole.mask.shape[1] <= seen.shape[1]
    assert whole.y0 + whole.mask.shape[0] <= seen.shape[0]


def test_a_picture_of_odd_size_is_no_error():
    seen, room = pictures()
    seen = seen[:147, :141]
    room = room[:73, :70]
    assert end_of(with_fingers(fist(), seen, room, nothing_covered(room), HEAD_PX)) == pytest.approx(139, abs=1)
