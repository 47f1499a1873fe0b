import cv2
import numpy as np
import pytest
from deixis_tracker.sway import CLEAR, SLIGHT, Glimpse

LATER_NS = 400_000_000


PLACE = 150, 120


@pytest.fixture
def room():
    """Picture without colour, nothing in it even."""
    rng = np.random.default_rng(2)
    picture = cv2.resize(rng.integers(110, 150, (24, 32), np.uint8), (320, 240), interpolation=cv2.INTER_CUBIC)
    return cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)


def with_head(room, dx=0.0, dy=0.0):
    """Something of a head's size at PLACE, moved by so many pixels before the room that stands."""
    head, shape = room.copy(), np.zeros(room.shape[:2], np.uint8)
    cv2.ellipse(shape, PLACE, (14, 19), 0, 0, 360, 255, -1)
    head[shape > 0] = 60
    cv2.circle(head, (PLACE[0] - 4, PLACE[1] - 4), 3, (20, 20, 20), -1)
    share = moved(cv2.GaussianBlur(shape, (5, 5), 0), dx, dy)[..., None] / 255
    return (moved(head, dx, dy) * share + room * (1 - share)).astype(np.uint8)


def moved(picture, dx, dy=0.0):
    return cv2.warpAffine(picture, np.array([[1, 0, dx], [0, 1, dy]]), (320, 240), borderMode=cv2.BORDER_REFLECT)


def noisy(picture, seed, gain=1.0):
    noise = np.random.default_rng(seed).normal(0, 3, (*picture.shape[:2], 1))
    return np.clip(picture * gain + noise, 0, 255).astype(np.uint8)


def seen(picture):
    glimpse = Glimpse.of(noisy(picture, 1), *PLACE, 30, 0)
    assert glimpse is not None
    return glimpse


@pytest.mark.parametrize(("dx", "dy"), [(0.6, 0.0), (-1.0, 0.3), (2.5, 0.0)])
def test_what_sways_by_a_pixel_is_noticed(room, dx, dy):
    assert seen(with_head(room)).sways(noisy(with_head(room, dx, dy), 2), LATER_NS, CLEAR)


def test_a_fifth_of_a_pixel_sways_slightly_and_not_clearly(room):
    glimpse, swayed = seen(with_head(room)), noisy(with_head(room, 0.25), 2)
    assert glimpse.sways(swayed, LATER_NS, SLIGHT)
    assert not glimpse.sways(swayed, LATER_NS, CLEAR)


@pytest.mark.parametrize("gain", [1.0, 0.6, 1.2])
def test_what_stands_does_not_sway_whatever_noise_and_light_do(room, gain):
    glimpse = seen(with_head(room))
    assert not any(glimpse.sways(noisy(with_head(room), seed, gain), LATER_NS, SLIGHT) for seed in range(2, 30))


@pytest.mark.parametrize(("dx", "dy"), [(0.3, 0.0), (0.0, -0.6), (1.0, 0.4)])
def test_what_a_trembling_camera_moves_with_the_room_does_not_sway(room, dx, dy):
    glimpse = seen(with_head(room))
    assert not glimpse.sways(noisy(moved(with_head(room), dx, dy), 2), LATER_NS, SLIGHT)


def test_pictures_that_follow_each_other_at_once_say_nothing(room):
    assert not seen(with_head(room)).sways(with_head(room, 1.0), 30_000_000, SLIGHT)


def test_another_picture_is_no_sway(room):
    other = cv2.flip(with_head(room), -1)
    assert not seen(with_head(room)).sways(other, LATER_NS, CLEAR)


@pytest.mark.parametrize(("x", "y"), [(5, 120), (150, 236), (-40, 10), (400, 300)])
def test_a_place_that_is_not_whole_in_the_picture_tells_nothing(room, x, y):
    assert Glimpse.of(with_head(room), x, y, 30, 0) is None


def test_an_even_wall_tells_nothing():
    assert Glimpse.of(np.full((240, 320, 3), 90, np.uint8), 150, 120, 30, 0) is None
