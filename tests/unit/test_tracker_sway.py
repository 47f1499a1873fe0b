import cv2
import numpy as np
import pytest
from deixis_tracker.sway import Glimpse

LATER_NS = 400_000_000


@pytest.fixture
def scene():
    """Picture without colour, with something of a head's size at (150, 120)."""
    rng = np.random.default_rng(2)
    picture = cv2.resize(rng.integers(60, 200, (24, 32), np.uint8), (320, 240), interpolation=cv2.INTER_CUBIC)
    cv2.ellipse(picture, (150, 120), (14, 19), 0, 0, 360, 90, -1)
    cv2.circle(picture, (146, 116), 3, 30, -1)
    return cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)


def moved(picture, dx, dy=0.0):
    return cv2.warpAffine(picture, np.array([[1, 0, dx], [0, 1, dy]]), (320, 240), borderMode=cv2.BORDER_REFLECT)


def noisy(picture, seed, gain=1.0):
    noise = np.random.default_rng(seed).normal(0, 4, (*picture.shape[:2], 1))
    return np.clip(picture * gain + noise, 0, 255).astype(np.uint8)


def seen(picture):
    glimpse = Glimpse.of(noisy(picture, 1), 150, 120, 30, 0)
    assert glimpse is not None
    return glimpse


@pytest.mark.parametrize(("dx", "dy"), [(0.6, 0.0), (-1.0, 0.3), (2.5, 0.0)])
def test_what_sways_by_a_pixel_is_noticed(scene, dx, dy):
    assert seen(scene).sways(noisy(moved(scene, dx, dy), 2), LATER_NS)


@pytest.mark.parametrize("gain", [1.0, 0.6, 1.2])
def test_what_stands_does_not_sway_whatever_noise_and_light_do(scene, gain):
    glimpse = seen(scene)
    assert not any(glimpse.sways(noisy(scene, seed, gain), LATER_NS) for seed in range(2, 30))


def test_pictures_that_follow_each_other_at_once_say_nothing(scene):
    assert not seen(scene).sways(moved(scene, 1.0), 30_000_000)


def test_another_picture_is_no_sway(scene):
    other = cv2.flip(scene, -1)
    assert not seen(scene).sways(other, LATER_NS)


@pytest.mark.parametrize(("x", "y"), [(5, 120), (150, 236), (-40, 10), (400, 300)])
def test_a_place_that_is_not_whole_in_the_picture_tells_nothing(scene, x, y):
    assert Glimpse.of(scene, x, y, 30, 0) is None


def test_an_even_wall_tells_nothing():
    assert Glimpse.of(np.full((240, 320, 3), 90, np.uint8), 150, 120, 30, 0) is None
