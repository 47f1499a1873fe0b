import numpy as np
import pytest
from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import plan_jobs
from deixis_tracker.tracker import Tracker
from pydantic import ValidationError


@pytest.mark.parametrize("size", [(64, 64), (480, 640), (1080, 1920), (640, 360)])
def test_a_picture_of_noise_of_any_size_has_nobody_in_it(size):
    rng = np.random.default_rng(1)
    tracker = Tracker(TrackerConfig())
    for k in range(3):
        assert tracker.update(rng.integers(0, 256, (*size, 3), np.uint8), k * 33_000_000) == []


def test_a_change_of_size_in_mid_stream_starts_anew():
    tracker = Tracker(TrackerConfig())
    for k, size in enumerate([(480, 640), (240, 320), (480, 640)]):
        assert tracker.update(np.full((*size, 3), 90, np.uint8), k * 33_000_000) == []


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
    with pytest.raises(ValueError, match=says):
        Tracker(TrackerConfig()).update(image, 0)


def test_an_unknown_setting_is_refused_by_name():
    with pytest.raises(ValidationError, match="hand_lenght"):
        TrackerConfig(hand_lenght=1.0)


def test_no_piece_of_the_face_search_is_larger_than_the_budget_of_a_frame():
    config = TrackerConfig()
    jobs = plan_jobs(480, 640, config)
    assert max(job.megapixels for job in jobs) <= config.search_budget_mpx
    assert min(job.scale for job in jobs) < 0.1
    assert max(job.scale for job in jobs) > 0.8
