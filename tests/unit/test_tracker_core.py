import cv2
import numpy as np
import pytest
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import FrameRefused, Tracker
from pydantic import ValidationError


@pytest.mark.parametrize("size", [(64, 64), (480, 640), (1080, 1920), (640, 360)])
def test_a_picture_of_noise_of_any_size_has_nobody_in_it(size):
    rng = np.random.default_rng(1)
    tracker = Tracker(TrackerConfig())
    for k in range(3):
        assert tracker.update(rng.integers(0, 256, (*size, 3), np.uint8), 1, k * 33_000_000) == []


def test_a_change_of_size_in_mid_stream_starts_anew():
    tracker = Tracker(TrackerConfig())
    for k, size in enumerate([(480, 640), (240, 320), (480, 640)]):
        assert tracker.update(np.full((*size, 3), 90, np.uint8), 1, k * 33_000_000) == []


@pytest.mark.parametrize(
    ("image", "says"),
    [
        (np.zeros((48, 64), np.uint8), "image"),
        (np.zeros((48, 64, 4), np.uint8), "image"),
        (np.zeros((48, 64, 3), np.float32), "float32"),
        (np.zeros((10, 10, 3), np.uint8), "10 x 10"),
    ],
)
def test_what_is_no_frame_is_refused_with_the_cause(image, says):
    with pytest.raises(FrameRefused, match=says):
        Tracker(TrackerConfig()).update(image, 1, 0)


def test_an_unknown_setting_is_refused_by_name():
    with pytest.raises(ValidationError, match="hand_lenght"):
        TrackerConfig(hand_lenght=1.0)


@pytest.fixture
def frames(example_clip):
    capture = cv2.VideoCapture(str(example_clip))
    return [capture.read()[1] for _ in range(126)]


def test_a_clock_set_back_by_40_ms_forgets_neither_the_person_nor_a_hand(frames):
    tracker = Tracker(TrackerConfig())
    shown = []
    for k in range(40):
        set_back_ns = 40_000_000 if k >= 30 else 0
        tracks = tracker.update(frames[k], 1, k * 33_333_333 - set_back_ns)
        shown.append([(t.track_id, t.kind) for t in tracks])
    assert {kind for _, kind in shown[29]} == {"face", "left_hand", "right_hand"}
    assert all(tracks == shown[29] for tracks in shown[30:])


def test_another_run_begins_anew(frames):
    tracker = Tracker(TrackerConfig())
    for k in range(10):
        tracks = tracker.update(frames[k], 1, k * 33_333_333)
    before = {track.track_id for track in tracks}
    assert before
    anew = tracker.update(frames[10], 2, 10 * 33_333_333)
    assert before.isdisjoint(track.track_id for track in anew)
    assert {track.kind for track in anew} <= {"face"}  # hands, which were known by then, are looked for again


def shares(frames, rate_hz):
    """Share of frames in which the face is tracked, and in which a hand is above the waist."""
    tracker = Tracker(TrackerConfig())
    faces, raised = [], []
    for k in range(int(len(frames) * rate_hz / 30)):
        tracks = tracker.update(frames[int(k * 30 / rate_hz)], 1, round(k * 1e9 / rate_hz))
        face = next((t for t in tracks if t.kind == "face"), None)
        faces.append(face is not None)
        waist = face.centroid_px[1] + 3.5 * face.bbox_px[2] if face else 0
        raised.append(any(t.kind != "face" and t.centroid_px[1] < waist for t in tracks))
    return np.mean(faces), np.mean(raised)


@pytest.mark.parametrize("rate_hz", [10, 15, 60])
def test_other_frame_rates_find_face_and_raised_hand_in_the_same_share_of_frames(frames, rate_hz):
    expected = shares(frames, 30)
    assert expected[0] > 0.95
    assert expected[1] > 0.3
    assert shares(frames, rate_hz) == pytest.approx(expected, abs=0.05)
