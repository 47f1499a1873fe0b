import cv2
import numpy as np
import pytest
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import LEFT_HAND, STRIDE, Surroundings
from deixis_tracker.found_hands import found_hands
from deixis_tracker.frame import Views, coarsened
from deixis_tracker.heads import HeadColours
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import Person
from deixis_tracker.segmentation import Blob

WIDTH = 40.0
HAND = 300, 200


def seen(image):
    coarse = coarsened(image)
    nothing = np.zeros(coarse.shape[:2], np.uint8)
    return Views(image, 1.0, image, coarse, nothing, nothing)


@pytest.fixture
def person():
    """Somebody whose left hand the finder sees at HAND."""
    maps = np.full((4, 120, 160), -9.0, np.float32)
    maps[LEFT_HAND, HAND[1] // STRIDE, HAND[0] // STRIDE] = 4
    somebody = Person(0, 0, PointFilter(220, 100, 1.0, 500.0), WIDTH, HeadColours(), 0, 0)
    somebody.around = Surroundings(maps, 0, 0, 1.0)
    return somebody


def test_a_gloved_hand_is_cut_out_by_the_colour_of_its_middle(person):
    image = np.full((480, 640, 3), 200, np.uint8)
    cv2.ellipse(image, HAND, (16, 8), 30, 0, 360, (160, 60, 20), -1)
    blobs = found_hands(seen(image), [person], [], TrackerConfig())
    assert len(blobs) == 1
    blob = blobs[0]
    mask = np.zeros(image.shape[:2], np.uint8)
    mask[blob.y0 : blob.y0 + blob.mask.shape[0], blob.x0 : blob.x0 + blob.mask.shape[1]] = blob.mask
    glove = image[..., 2] < 100
    assert (mask[glove] > 0).mean() > 0.85
    assert (mask[~glove] > 0).sum() < 0.1 * glove.sum()


def test_a_hand_that_nothing_tells_from_the_wall_is_taken_for_a_disk(person):
    blobs = found_hands(seen(np.full((480, 640, 3), 120, np.uint8)), [person], [], TrackerConfig())
    assert [blob.area for blob in blobs] == [pytest.approx(np.pi * (0.3 * WIDTH) ** 2, rel=0.1)]


def test_a_hand_that_colour_has_given_already_is_not_given_twice(person):
    known = Blob(np.ones((20, 20), np.uint8), HAND[0] - 10, HAND[1] - 10, 400, 1.0, 0.9)
    assert found_hands(seen(np.full((480, 640, 3), 120, np.uint8)), [person], [known], TrackerConfig()) == []


def test_a_hand_that_two_people_could_have_is_whose_it_fits_better(person):
    other = Person(1, 1, PointFilter(400, 110, 1.0, 500.0), WIDTH, HeadColours(), 0, 0)
    maps = np.full((4, 120, 160), -9.0, np.float32)
    maps[LEFT_HAND, HAND[1] // STRIDE, HAND[0] // STRIDE] = 5
    other.around = Surroundings(maps, 0, 0, 1.0)
    blobs = found_hands(seen(np.full((480, 640, 3), 120, np.uint8)), [person, other], [], TrackerConfig())
    assert [blob.owner for blob in blobs] == [1]


def test_a_hand_out_of_reach_is_nobodys(person):
    person.motion = PointFilter(20, 400, 1.0, 500.0)
    assert found_hands(seen(np.full((480, 640, 3), 120, np.uint8)), [person], [], TrackerConfig()) == []
