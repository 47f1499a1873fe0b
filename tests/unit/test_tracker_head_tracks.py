from itertools import count

import cv2
import numpy as np
import pytest
from deixis_schemas.anatomy import FACE_WIDTH_M, HEAD_WIDTH_M
from deixis_tracker.background import Background, MotionHistory
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import Finder
from deixis_tracker.frame import Step, Views, coarsened
from deixis_tracker.head_tracks import HeadTracks
from deixis_tracker.heads import HeadColours
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import Person, tracks_of
from deixis_tracker.skin import SkinModel
from deixis_tracker.tracker import Tracker

PERIOD_NS = 33_333_333


@pytest.fixture
def frames(example_clip):
    capture = cv2.VideoCapture(str(example_clip))
    return [capture.read()[1] for _ in range(48)]


def person_at(x, y, width=50.0):
    return Person(0, 0, PointFilter(x, y, 1.0, 500.0), width, HeadColours(), 0, 0, 0)


def views_of(image):
    coarse = coarsened(image)
    black = np.zeros(coarse.shape[:2], np.uint8)
    return Views(image, 1.0, image, coarse, black, black)


def test_a_head_that_leaves_the_picture_between_two_frames_is_let_go():
    views = views_of(np.full((480, 640, 3), 90, np.uint8))
    heads = HeadTracks((480, 640), 1.0, TrackerConfig(), Finder(), count(), count())
    heads.persons.append(person_at(900, 200))
    heads.update(
        views, Background(views.coarse, 20), MotionHistory(views.coarse), SkinModel(0.2), Step(PERIOD_NS, PERIOD_NS, PERIOD_NS)
    )
    assert heads.persons == []


def test_a_published_face_is_as_wide_as_the_contract_says_and_centred_on_the_head():
    track = tracks_of(person_at(300, 200), 0, 2.0)[0]
    x, _, width, _ = track.bbox_px
    assert width == pytest.approx(2 * 50 * FACE_WIDTH_M / HEAD_WIDTH_M)
    assert x + width / 2 == pytest.approx(2 * (300 + 0.5) - 0.5)


def test_a_clear_face_is_followed_from_the_first_picture_on(frames):
    assert [track.kind for track in Tracker(TrackerConfig()).update(frames[0], 1, 0)] == ["face"]


def in_profile(hair_bgr):
    """A head at (100, 80) in coarse pixels, all of it the colour of skin, face to the left."""
    coarse = np.full((240, 320, 3), 200, np.uint8)
    skin = np.zeros(coarse.shape[:2], np.uint8)
    skin[55:105, 80:120] = 255
    coarse[55:105, 80:120] = hair_bgr
    coarse[60:105, 80:92] = (120, 140, 190)
    return Views(coarse, 2.0, coarse, coarse, skin, skin)


@pytest.mark.parametrize(
    ("brightness", "hair_bgr", "x"), [(150, (30, 45, 60), 86), (None, (30, 45, 60), 100), (150, (90, 120, 160), 100)]
)
def test_a_turned_face_is_where_the_skin_is_not_as_dark_as_hair(brightness, hair_bgr, x):
    heads = HeadTracks((480, 640), 1.0, TrackerConfig(), Finder(), count(), count())
    centre = heads._centre_of_skin(person_at(200, 160, 80.0), in_profile(hair_bgr), brightness)
    assert centre is not None
    assert centre[0] / 2 == pytest.approx(x, abs=1.5)


def test_a_new_face_is_measured_in_each_frame_and_later_every_0_8_s(frames):
    tracker = Tracker(TrackerConfig())
    seen = [k for k, image in enumerate(frames) if any(t.frontal for t in tracker.update(image, 1, k * PERIOD_NS))]
    assert seen[:5] == list(range(seen[0], seen[0] + 5))
    assert len(seen[5:]) == pytest.approx((len(frames) - seen[4]) / 24, abs=1)


def test_a_face_that_is_uncovered_again_is_measured_ten_times_a_second(frames):
    tracker = Tracker(TrackerConfig())
    measured = []
    for k, image in enumerate([*frames[:20], *[frames[19].copy() for _ in range(30)], *frames[20:40]]):
        if 20 <= k < 50:
            image[120:220, 260:380] = 90
        measured += [k for track in tracker.update(image, 1, k * PERIOD_NS) if track.frontal]
    assert not set(measured) & set(range(20, 50))
    assert len([k for k in measured if k >= 50]) == pytest.approx(20 / 3, abs=2)


@pytest.mark.parametrize("scale", [0.8, 2.5])
def test_a_measured_face_lies_on_its_track_in_pixels_of_the_frame(frames, scale):
    tracker = Tracker(TrackerConfig())
    measured = []
    for k, image in enumerate(frames[:16]):
        larger = np.asarray(cv2.resize(image, None, fx=scale, fy=scale), np.uint8)
        measured += [track for track in tracker.update(larger, 1, k * PERIOD_NS) if track.frontal]
    assert len(measured) >= 5
    for track in measured:
        x, y, width, height = track.bbox_px
        assert track.frontal.centre_px == pytest.approx((x + width / 2, y + 0.44 * height), abs=0.15 * width)
        assert track.frontal.width_px == pytest.approx(width, rel=0.2)


def two_people(image):
    return np.hstack([image[:, 160:480]] * 2)


def test_of_two_people_one_face_is_measured_in_a_frame(frames):
    tracker = Tracker(TrackerConfig())
    measured = set()
    for k, image in enumerate(frames[:20]):
        faces = [t.person_id for t in tracker.update(two_people(image), 1, k * PERIOD_NS) if t.frontal]
        assert len(faces) <= 1
        measured.update(faces)
    assert measured == {0, 1}


def test_a_face_that_is_one_too_many_is_counted(frames):
    tracker = Tracker(TrackerConfig(max_persons=1))
    left_out = 0
    for k, image in enumerate(frames[:12]):
        persons = {t.person_id for t in tracker.update(two_people(image), 1, k * PERIOD_NS)}
        left_out += tracker.left_out
    assert persons == {0}
    assert left_out > 0
