import cv2
import numpy as np
import pytest
from deixis_tracker.camera_motion import CameraMotion, Shift
from deixis_tracker.frame import Step
from deixis_tracker.tracker import Tracker, TrackerConfig
from hypothesis import given
from hypothesis import strategies as st

FRAME_NS = 33_333_333
HEIGHT, WIDTH = 240, 320  # of the coarse picture, half of the working one
NOBODY = np.zeros((HEIGHT, WIDTH), np.uint8)


def step(k):
    return Step(10**9 + k * FRAME_NS, k * FRAME_NS, FRAME_NS)


@pytest.fixture
def wall():
    """A patterned wall, larger than the picture."""
    blobs = np.random.default_rng(4).integers(0, 256, (60, 90, 3), np.uint8)
    return cv2.resize(blobs, (900, 600), interpolation=cv2.INTER_CUBIC)


def part(wall, x, y):
    """The coarse picture of a camera that looks at (x, y) of the wall."""
    return cv2.getRectSubPix(wall, (WIDTH, HEIGHT), (x, y))


@pytest.mark.parametrize("dx", [1.0, 3.0, -4.0])
def test_a_turning_camera_is_noticed_and_its_room_followed(wall, dx):
    camera = CameraMotion(part(wall, 400, 300))
    for k in range(1, 11):
        shift = camera.update(part(wall, 400 - dx * k, 300), NOBODY, step(k))
        assert shift.moved(100, 80) == pytest.approx((100 + 2 * dx, 80), abs=0.4)
    assert camera.moves
    assert camera.offset == pytest.approx((20 * dx, 0), abs=0.5)


@pytest.mark.parametrize("dx", [0.05, 0.25])
def test_what_is_too_slow_to_be_seen_between_two_pictures_adds_up(wall, dx):
    camera = CameraMotion(part(wall, 400, 300))
    for k in range(1, 61):
        camera.update(part(wall, 400 - dx * k, 300), NOBODY, step(k))
    assert camera.moves
    assert camera.offset == pytest.approx((120 * dx, 0), abs=1.6)


def test_a_camera_that_drives_ahead_is_followed_by_scale(wall):
    camera, near = CameraMotion(part(wall, 400, 300)), cv2.getRotationMatrix2D((WIDTH / 2, HEIGHT / 2), 0, 1.02)
    shift = camera.update(cv2.warpAffine(part(wall, 400, 300), near, (WIDTH, HEIGHT)), NOBODY, step(1))
    assert shift.moved(0, 0) == pytest.approx((-0.02 * WIDTH, -0.02 * HEIGHT), abs=0.8)
    assert camera.offset == pytest.approx((0, 0), abs=0.4)


def test_noise_and_switched_light_are_no_motion(wall):
    rng, picture = np.random.default_rng(1), part(wall, 400, 300)
    camera = CameraMotion(picture)
    for k, gain in enumerate([1.0, 1.0, 0.6, 0.6, 1.2, 1.2], 1):
        noisy = np.clip(picture * gain + rng.normal(0, 4, picture.shape), 0, 255).astype(np.uint8)
        assert camera.update(noisy, NOBODY, step(k)).is_none
    assert not camera.moves


def test_people_who_walk_are_no_motion_of_the_camera(wall):
    camera, person = CameraMotion(part(wall, 400, 300)), part(wall, 600, 200)[:200, :110]
    for k in range(1, 8):
        picture, people = part(wall, 400, 300), NOBODY.copy()
        picture[30:230, 20 + 6 * k : 130 + 6 * k] = person
        people[20:, 5 + 6 * k : 145 + 6 * k] = 255
        assert camera.update(picture, people, step(k)).is_none


def test_an_empty_wall_and_a_black_picture_are_no_motion():
    camera = CameraMotion(np.full((HEIGHT, WIDTH, 3), 120, np.uint8))
    assert camera.update(np.full((HEIGHT, WIDTH, 3), 160, np.uint8), NOBODY, step(1)).is_none
    assert camera.update(np.zeros((HEIGHT, WIDTH, 3), np.uint8), NOBODY, step(2)).is_none


@given(st.floats(0.9, 1.1), st.floats(-20, 20), st.floats(-20, 20), st.floats(0.25, 4), st.floats(0, 600), st.floats(0, 400))
def test_a_shift_is_the_same_in_pictures_of_every_size(zoom, dx, dy, scale, x, y):
    shift = Shift(np.array([[zoom, 0.02, dx], [-0.02, zoom, dy]]))
    smaller = shift.of_size(scale) @ ((x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5, 1.0)
    assert (smaller + 0.5) / scale - 0.5 == pytest.approx(shift.moved(x, y), abs=1e-6)


def panned(example_clip, speed_px, count=100):
    """Tracks of the example clip, each frame shifted by so many pixels more, and how far its room went at last."""
    capture, tracker, seen = cv2.VideoCapture(str(example_clip)), Tracker(TrackerConfig()), []
    for k in range(count):
        frame = capture.read()[1]
        shift = np.array([[1.0, 0, speed_px * k], [0, 1, 0]])
        frame = cv2.warpAffine(frame, shift, frame.shape[1::-1], borderMode=cv2.BORDER_REFLECT_101)
        seen.append({(t.kind, t.track_id) for t in tracker.update(frame, 1, k * FRAME_NS)})
    return seen, tracker.room_offset_px


def test_a_slow_pan_costs_neither_face_nor_hands(example_clip):
    still, nowhere = panned(example_clip, 0)
    turning, offset = panned(example_clip, 1)
    assert nowhere == (0.0, 0.0)
    assert offset == pytest.approx((99.0, 0.0), abs=6.0)
    for kind in ("face", "left_hand", "right_hand"):
        seen = [sum(any(k == kind for k, _ in tracks) for tracks in run) for run in (still, turning)]
        assert seen[1] >= 0.9 * seen[0]
    assert len({track_id for tracks in turning for kind, track_id in tracks if kind == "face"}) == 1
