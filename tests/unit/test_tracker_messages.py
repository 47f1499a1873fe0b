import cv2
import numpy as np
import pytest
from deixis_schemas.messages import Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_tracks_of_the_example_are_in_pixels_of_the_given_frame_and_fit_their_message(example_clip, scale):
    capture = cv2.VideoCapture(str(example_clip))
    tracker = Tracker(TrackerConfig())
    tracks = []
    for k in range(8):
        ok, image = capture.read()
        assert ok
        tracks = tracker.update(np.asarray(cv2.resize(image, None, fx=scale, fy=scale), np.uint8), 1, k * 33_000_000)
    message = Tracks(
        run=1,
        seq=7,
        stamp_ns=1,
        stage="tracker",
        instance="t",
        width=image.shape[1],
        height=image.shape[0],
        tracks=[t.model_dump() for t in tracks],
    )
    faces = [track for track in message.tracks if track.kind == "face"]
    assert len(faces) == 1
    assert type(faces[0].centroid_px[0]) is float
    assert 0.04 * scale * 640 < faces[0].bbox_px[2] < 0.16 * scale * 640
    assert faces[0].observed
