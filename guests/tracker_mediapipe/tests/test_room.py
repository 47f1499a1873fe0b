"""How far the room has moved: told by what is nobody, whatever people do, and never by chance."""

import cv2
import numpy as np
import pytest
from deixis_tracker_mediapipe.room import Room

SIZE = 640, 480
ROOM = cv2.GaussianBlur(np.random.default_rng(1).integers(0, 256, (560, 900, 3), dtype=np.uint8), (0, 0), 3)
ROOM = cv2.normalize(ROOM, None, 0, 255, cv2.NORM_MINMAX)


def picture(dx, dy=0.0, person_x=None, noise=2.0, seed=0):
    """The room moved by so much, and maybe somebody in it, wherever the room is."""
    warp = np.array([[1.0, 0, dx - 130], [0, 1, dy - 40]])
    seen = cv2.warpAffine(ROOM, warp, SIZE, flags=cv2.INTER_LINEAR).astype(float)
    if person_x is not None:
        checks = np.random.default_rng(2).integers(0, 256, (50, 20, 3)).repeat(8, axis=0).repeat(8, axis=1)
        seen[80:, int(person_x) - 80 : int(person_x) + 80] = checks[:400]
    seen += np.random.default_rng(seed).normal(0, noise, seen.shape)
    return seen.clip(0, 255).astype(np.uint8)


def test_a_camera_that_turns_moves_the_room_by_as_much_also_beyond_the_first_picture():
    room = Room()
    for number in range(60):
        room.see(picture(2.0 * number - 60, 0.5 * number, seed=number), [])
    assert room.offset_px == pytest.approx((118.0, 29.5), abs=1.0)


def test_a_camera_that_stands_has_no_offset_after_a_long_time():
    room = Room()
    for number in range(300):
        room.see(picture(0, seed=number, noise=4.0), [])
    assert room.offset_px == pytest.approx((0.0, 0.0), abs=0.3)


def test_a_person_who_walks_past_moves_no_room():
    room = Room()
    for number in range(60):
        x = 120 + 6 * number
        room.see(picture(0, person_x=x, seed=number), [((x, 140.0), 70.0)])
    assert room.offset_px == pytest.approx((0.0, 0.0), abs=0.5)


def test_without_anything_to_hold_on_to_nothing_is_said_to_move():
    room, blank = Room(), np.full((480, 640, 3), 120, np.uint8)
    for number in range(10):
        room.see(np.roll(blank, number, axis=1), [])
    assert room.offset_px == (0.0, 0.0)


def test_another_run_of_the_camera_begins_at_nothing():
    room = Room()
    for number in range(10):
        room.see(picture(3.0 * number, seed=number), [])
    assert room.offset_px[0] > 20
    room.forget()
    assert room.offset_px == (0.0, 0.0)
    room.see(picture(27), [])
    assert room.offset_px == (0.0, 0.0)
