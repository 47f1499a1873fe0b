import cv2
import numpy as np
import pytest
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import LEFT_HAND, RIGHT_HAND, STRIDE, Surroundings
from deixis_tracker.found_hands import found_hands
from deixis_tracker.frame import Step, Views, coarsened
from deixis_tracker.heads import HeadColours
from deixis_tracker.hypotheses import sample_pixels
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import HandTrack, Person
from deixis_tracker.segmentation import Blob

WIDTH = 40.0
HAND = 300, 200
STEP = Step(2_000_000_000, 2_000_000_000, 33_333_333)
WALL = np.full((480, 640, 3), 120, np.uint8)


def found(image, persons, blobs, came=(), unknown=False):
    """Blobs with those found, where something has come before the room about the places `came`."""
    coarse = coarsened(image)
    nothing = np.zeros(coarse.shape[:2], np.uint8)
    changed = nothing.copy()
    for x, y in came:
        cv2.circle(changed, (x // 2, y // 2), 15, 255, -1)
    views = Views(image, 1.0, image, coarse, nothing, changed)
    return found_hands(views, nothing + np.uint8(255 * unknown), persons, blobs, TrackerConfig(), STEP)


def look(person, places):
    """Give a person what the finder saw in this frame: log odds by side and place."""
    maps = np.full((4, 120, 160), -9.0, np.float32)
    for (kind, (x, y)), odds in places.items():
        maps[kind, y // STRIDE, x // STRIDE] = odds
    person.around, person.around_ns = Surroundings(maps, 0, 0, 1.0), STEP.now_ns
    return person


def tracked(x, y, speed=0.0):
    """A left hand that was seen at (x, y) just now."""
    motion = PointFilter(x, y, 3.0, 3000.0)
    motion.vx = speed
    now_ns = STEP.now_ns
    pixels = sample_pixels(np.ones((20, 20), np.uint8), x - 10, y - 10)
    hand = HandTrack(1, motion, pixels, None, now_ns, "left_hand", evidence=1.0, watched_s=1.0, likely_ns=now_ns)
    assert np.hypot(hand.last_seen[0] - x, hand.last_seen[1] - y) < 2
    return hand


def square(x, y, side):
    """A blob about a place."""
    return Blob(np.ones((side, side), np.uint8), x - side // 2, y - side // 2, side * side, 1.0, 0.9)


@pytest.fixture
def person():
    """Somebody whose left hand the finder sees at HAND."""
    maps = np.full((4, 120, 160), -9.0, np.float32)
    maps[LEFT_HAND, HAND[1] // STRIDE, HAND[0] // STRIDE] = 4
    somebody = Person(0, 0, PointFilter(220, 100, 1.0, 500.0), WIDTH, HeadColours(), 0, 0)
    somebody.around = Surroundings(maps, 0, 0, 1.0)
    return somebody


def strip(x, y):
    """A blob about a place that is thinner than a hand."""
    return Blob(np.ones((7, 24), np.uint8), x - 12, y - 3, 168, 1.0, 0.9)


def test_a_gloved_hand_is_cut_out_by_the_colour_of_its_middle(person):
    image = np.full((480, 640, 3), 200, np.uint8)
    cv2.ellipse(image, HAND, (16, 8), 30, 0, 360, (160, 60, 20), -1)
    blobs = found(image, [person], [])
    assert len(blobs) == 1
    blob = blobs[0]
    mask = np.zeros(image.shape[:2], np.uint8)
    mask[blob.y0 : blob.y0 + blob.mask.shape[0], blob.x0 : blob.x0 + blob.mask.shape[1]] = blob.mask
    glove = image[..., 2] < 100
    assert (mask[glove] > 0).mean() > 0.85
    assert (mask[~glove] > 0).sum() < 0.1 * glove.sum()


def test_a_hand_that_nothing_tells_from_the_wall_is_taken_for_a_disk(person):
    blobs = found(WALL, [person], [])
    assert [blob.area for blob in blobs] == [pytest.approx(np.pi * (0.3 * WIDTH) ** 2, rel=0.1)]


def test_a_hand_that_colour_has_given_already_is_not_given_twice(person):
    known = Blob(np.ones((20, 20), np.uint8), HAND[0] - 10, HAND[1] - 10, 400, 1.0, 0.9)
    assert found(WALL, [person], [known]) == [known]


def test_a_hand_that_two_people_could_have_is_whose_it_fits_better(person):
    other = Person(1, 1, PointFilter(400, 110, 1.0, 500.0), WIDTH, HeadColours(), 0, 0)
    maps = np.full((4, 120, 160), -9.0, np.float32)
    maps[LEFT_HAND, HAND[1] // STRIDE, HAND[0] // STRIDE] = 5
    other.around = Surroundings(maps, 0, 0, 1.0)
    blobs = found(WALL, [person, other], [])
    assert [blob.owner for blob in blobs] == [1]


def test_a_hand_out_of_reach_is_nobodys(person):
    person.motion = PointFilter(20, 400, 1.0, 500.0)
    assert found(WALL, [person], []) == []


def test_a_hand_whose_side_is_in_doubt_is_a_hand(person):
    look(person, {(LEFT_HAND, HAND): 0.3, (RIGHT_HAND, HAND): 0.3})
    assert len(found(WALL, [person], [], came=[HAND])) == 1
    look(person, {(LEFT_HAND, HAND): 0.3})
    assert found(WALL, [person], [], came=[HAND]) == []


def test_what_stands_in_the_room_is_no_hand_unless_it_looks_very_much_like_one(person):
    look(person, {(LEFT_HAND, HAND): 1.2})
    assert found(WALL, [person], []) == []
    assert len(found(WALL, [person], [], came=[HAND])) == 1
    look(person, {(LEFT_HAND, HAND): 2.5})
    assert len(found(WALL, [person], [])) == 1


def test_where_the_room_is_not_known_a_hand_need_not_have_come(person):
    look(person, {(LEFT_HAND, HAND): 1.2})
    assert len(found(WALL, [person], [], unknown=True)) == 1


@pytest.mark.parametrize(("dx", "dy", "number"), [(-0.5, 0.1, 1), (0.0, 0.2, 1), (0.9, 1.2, 0), (-0.9, 1.3, 0)])
def test_a_hand_before_the_face_is_found_and_a_shoulder_is_none(person, dx, dy, number):
    place = round(person.x + dx * WIDTH), round(person.y + dy * WIDTH)
    look(person, {(LEFT_HAND, place): 2.0})
    assert len(found(WALL, [person], [], came=[place])) == number
    assert found(WALL, [person], []) == []


def test_a_bare_forearm_gives_way_to_the_hand_at_its_end(person):
    arm = square(HAND[0] - 35, HAND[1], 40)
    look(person, {(LEFT_HAND, HAND): 2.0})
    blobs = found(WALL, [person], [arm], came=[HAND])
    assert len(blobs) == 1
    assert blobs[0].owner == person.person_id


def test_what_may_be_the_other_hand_is_no_forearm(person):
    other = square(HAND[0] - 35, HAND[1], 40)
    look(person, {(LEFT_HAND, HAND): 2.0, (RIGHT_HAND, (HAND[0] - 35, HAND[1])): -0.5})
    assert any(blob is other for blob in found(WALL, [person], [other], came=[HAND]))


def test_a_piece_of_a_hand_is_made_whole(person):
    look(person, {(LEFT_HAND, HAND): 2.0})
    piece = strip(HAND[0] + 10, HAND[1])
    blobs = found(WALL, [person], [piece], came=[HAND])
    assert len(blobs) == 1
    assert blobs[0].area > 2 * piece.area
    columns = np.nonzero(blobs[0].mask)[1] + blobs[0].x0
    assert columns.max() >= HAND[0] + 21


def test_a_small_hand_that_colour_shows_is_left_as_it_is(person):
    look(person, {(LEFT_HAND, HAND): 2.0})
    hand = square(HAND[0] + 16, HAND[1], 16)
    (blob,) = found(WALL, [person], [hand], came=[HAND])
    assert blob is hand


def test_of_a_hand_that_moves_quickly_skin_says_more_than_an_earlier_look(person):
    look(person, {(LEFT_HAND, HAND): 2.0})
    person.around_ns -= STEP.passed_ns
    piece = strip(HAND[0] + 10, HAND[1])
    person.hands = [tracked(*HAND)]
    assert not any(blob is piece for blob in found(WALL, [person], [piece], came=[HAND]))
    person.hands = [tracked(*HAND, speed=8 * WIDTH)]
    assert any(blob is piece for blob in found(WALL, [person], [piece], came=[HAND]))


def test_the_finders_doubt_loses_no_hand_that_is_tracked(person):
    look(person, {(LEFT_HAND, HAND): 0.0})
    assert found(WALL, [person], [], came=[HAND]) == []
    person.hands = [tracked(HAND[0] + 10, HAND[1])]
    assert len(found(WALL, [person], [], came=[HAND])) == 1
    person.hands = [tracked(HAND[0] + 60, HAND[1])]
    assert found(WALL, [person], [], came=[HAND]) == []


def test_what_is_doubtful_and_stands_in_the_room_does_not_keep_itself_alive(person):
    look(person, {(LEFT_HAND, HAND): 0.0})
    person.hands = [tracked(*HAND)]
    person.hands[0].kind = "unknown"
    cell = square(*HAND, 8)
    assert found(WALL, [person], [cell], came=[(HAND[0] - 36, HAND[1])]) == [cell]
