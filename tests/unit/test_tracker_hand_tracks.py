from itertools import count

import numpy as np
import pytest
from deixis_tracker.background import Background, MotionHistory
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import RIGHT_HAND, STRIDE, Surroundings
from deixis_tracker.frame import Step, Views, coarsened
from deixis_tracker.hand_tracks import HandTracks
from deixis_tracker.heads import HeadColours
from deixis_tracker.hypotheses import sample_pixels
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import HandTrack, Person, tracks_of
from deixis_tracker.segmentation import Blob, hand_blobs
from deixis_tracker.skin import SkinModel

STEP = Step(1_033_333_333, 1_033_333_333, 33_333_333)
SKIN, WALL = (90, 120, 190), (200, 150, 110)


def hand_at(number, kind, x, y):
    pixels = sample_pixels(np.ones((30, 30), np.uint8), x, y)
    motion = PointFilter(x + 14.5, y + 14.5, 3.0, 3000.0)
    return HandTrack(number, motion, pixels, None, 1_000_000_000, kind, evidence=1.0, watched_s=1.0)


@pytest.fixture
def person():
    somebody = Person(0, 0, PointFilter(320, 100, 1.0, 1000.0), 50.0, HeadColours(), 0, 0, 0)
    somebody.hands = [hand_at(1, "right_hand", 280, 240), hand_at(2, "left_hand", 310, 240)]
    return somebody


def contours_of(person):
    tracks = tracks_of(person, STEP.now_ns, 1.0)[1:]
    return {t.kind: np.frombuffer(t.contour, "<i2").reshape(-1, 2) for t in tracks}


def test_two_hands_grown_into_one_blob_are_published_with_a_contour_each(person):
    folded = Blob(np.ones((30, 60), np.uint8), 280, 240, 1800, 1.0, 0.9)
    HandTracks((480, 640), TrackerConfig(), count(3)).update([person], [folded], STEP)
    contours = contours_of(person)
    assert contours["right_hand"][:, 0].max() < contours["left_hand"][:, 0].min()


def test_a_hand_that_is_only_predicted_has_no_contour(person):
    HandTracks((480, 640), TrackerConfig(), count(3)).update([person], [], STEP)
    assert [len(contour) for contour in contours_of(person).values()] == [0, 0]


def test_the_contour_of_a_bare_arm_is_that_of_the_hand_alone(person):
    person.hands = person.hands[:1]
    arm = np.ones((150, 30), np.uint8)
    HandTracks((480, 640), TrackerConfig(), count(3)).update([person], [Blob(arm, 280, 150, 4500, 1.0, 0.9)], STEP)
    assert np.ptp(contours_of(person)["right_hand"][:, 1]) < 1.3 * person.width


def test_a_region_that_is_gone_at_full_resolution_is_no_blob(person):
    full = np.full((480, 640, 3), WALL, np.uint8)
    room = coarsened(full)
    seen = room.copy()
    seen[150:180, 160:162] = SKIN
    model = SkinModel(0.2)
    changed = np.asarray(255 * np.any(seen != room, axis=2), np.uint8)
    views = Views(full, 1.0, full, seen, np.asarray(changed * (model.probability(seen) > 150)), changed)
    background = Background(room, 20)
    background.changed(seen, np.zeros_like(changed))
    assert np.count_nonzero(views.skin) > 50
    assert hand_blobs(views, model, background, MotionHistory(room), [person], TrackerConfig()) == []


def seen_at(x, y, odds):
    """What the finder says that sees a right hand at a place of the picture."""
    maps = np.full((4, 120, 160), -9.0, np.float32)
    maps[RIGHT_HAND, y // STRIDE, x // STRIDE] = odds
    return Surroundings(maps, 0, 0, 1.0)


def full_of_holes(height, width):
    """The mask of an arm before a wall of the colour of skin."""
    mask = np.ones((height, width), np.uint8)
    mask[1::5] = 0
    mask[:, 2::7] = 0
    return mask


@pytest.mark.parametrize(("odds", "found"), [(2.0, True), (0.7, False)])
def test_a_hand_full_of_holes_is_mended_where_the_finder_surely_sees_it(person, odds, found):
    person.hands = []
    person.around, person.around_ns = seen_at(285, 250, odds), STEP.now_ns
    arm = Blob(full_of_holes(120, 34), 268, 155, 0, 1.0, 0.9)
    HandTracks((480, 640), TrackerConfig(), count(3)).update([person], [arm._replace(area=int(arm.mask.sum()))], STEP)
    assert len(person.hands) == found
    if found:
        assert person.hands[0].last_seen == pytest.approx((285, 252), abs=8)
        assert person.hands[0].blob.area > 0.3 * person.width**2


def followed(person, odds):
    """Middle of a hand at (285, 250) beside a wall of the colour of skin, tracked while the finder has such odds."""
    person.hands, places = [hand_at(1, "right_hand", 270, 235)], []
    hand_and_wall = Blob(np.ones((30, 90), np.uint8), 210, 235, 2700, 1.0, 0.9)
    tracks = HandTracks((480, 640), TrackerConfig(), count(3))
    for k, log_odds in enumerate(odds):
        person.around = seen_at(285, 250, log_odds)
        now_ns = STEP.now_ns + k * STEP.passed_ns
        tracks.update([person], [hand_and_wall], Step(now_ns, now_ns, STEP.passed_ns))
        places.append(person.hands[0].blob.centroid[0] if person.hands and person.hands[0].blob else None)
    return places


def test_a_hand_that_hangs_together_with_a_wall_is_cut_out_where_the_finder_sees_it(person):
    assert followed(person, [3.0] * 4) == pytest.approx([285] * 4, abs=12)


def test_it_does_not_leap_while_the_finder_doubts_for_a_moment(person):
    places = followed(person, [3.0, 3.0, 0.0, 3.0, 0.0, 3.0])
    assert np.ptp(places) < 3


def test_a_finder_that_sees_as_much_at_the_end_cuts_nothing_out(person):
    person.hands = [hand_at(1, "right_hand", 270, 235)]
    maps = np.full((4, 120, 160), 0.5, np.float32)
    maps[RIGHT_HAND, 250 // STRIDE, 285 // STRIDE] = 0.7
    person.around, person.around_ns = Surroundings(maps, 0, 0, 1.0), STEP.now_ns
    hand_and_wall = Blob(np.ones((30, 90), np.uint8), 210, 235, 2700, 1.0, 0.9)
    HandTracks((480, 640), TrackerConfig(), count(3)).update([person], [hand_and_wall], STEP)
    assert person.hands[0].blob.centroid[0] != pytest.approx(285, abs=12)


def found_on(person, blob, places, frames=1):
    """Kinds of the tracks after so many frames of one blob, and the hands; the finder sees hands of log odds at places."""
    tracks = HandTracks((480, 640), TrackerConfig(), count(3))
    maps = np.full((4, 120, 160), -9.0, np.float32)
    for (x, y), odds in places.items():
        maps[RIGHT_HAND, y // STRIDE, x // STRIDE] = odds
    for k in range(frames):
        now_ns = STEP.now_ns + k * STEP.passed_ns
        person.around, person.around_ns = Surroundings(maps, 0, 0, 1.0), now_ns
        tracks.update([person], [blob], Step(now_ns, now_ns, STEP.passed_ns))
    return person.hands


def test_the_end_of_a_raised_arm_that_looks_like_no_hand_is_its_elbow(person):
    person.hands = []
    arm = Blob(np.ones((110, 30), np.uint8), 300, 150, 3300, 1.0, 0.9)
    (hand,) = found_on(person, arm, {(315, 165): -0.3})
    assert hand.blob.centroid[1] < 190


@pytest.mark.parametrize(("frames", "leaves"), [(2, False), (6, True)])
def test_a_hand_leaves_the_end_of_its_arm_when_the_finder_sees_it_elsewhere_for_a_tenth_of_a_second(person, frames, leaves):
    person.hands = [hand_at(1, "right_hand", 280, 240)]
    arm = Blob(np.ones((125, 30), np.uint8), 280, 150, 3750, 1.0, 0.9)
    (hand,) = found_on(person, arm, {(295, 250): 0.8, (295, 208): 1.9}, frames)
    assert (hand.blob.centroid[1] < 225) is leaves


def test_what_the_finder_rules_out_begins_no_track(person):
    person.hands = []
    blob = Blob(np.ones((30, 30), np.uint8), 280, 240, 900, 1.0, 0.9)
    assert found_on(person, blob, {}) == []
    assert len(found_on(person, blob, {(295, 255): -0.5})) == 1


def test_what_the_finder_rules_out_for_long_is_called_no_hand(person):
    person.hands = person.hands[:1]
    person.hands[0].likely_ns = STEP.now_ns
    blob = Blob(np.ones((30, 30), np.uint8), 280, 240, 900, 1.0, 0.9)
    (hand,) = found_on(person, blob, {}, frames=4)
    assert hand.kind == "right_hand"
    person.hands[0].likely_ns = STEP.now_ns
    (hand,) = found_on(person, blob, {}, frames=10)
    assert hand.kind == "unknown"


def test_of_a_hand_that_the_picture_cuts_the_finder_may_see_nothing(person):
    person.hands = []
    blob = Blob(np.ones((30, 30), np.uint8), 280, 450, 900, 1.0, 0.9)
    person.motion = PointFilter(320, 280, 1.0, 1000.0)
    assert len(found_on(person, blob, {})) == 1
