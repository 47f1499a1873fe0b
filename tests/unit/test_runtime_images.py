"""Frames become pictures, or say why not."""

import cv2
import numpy as np
import pytest
from deixis_runtime.images import ImageError, decode_image
from deixis_schemas.messages import Frame


def frame(data, encoding, width=8, height=6):
    return Frame(
        run=1, seq=0, stamp_ns=0, stage="camera", instance="c", width=width, height=height, encoding=encoding, data=data
    )


@pytest.fixture
def picture():
    return np.random.default_rng(1).integers(0, 256, (6, 8, 3), dtype=np.uint8)


def test_raw_colour_comes_back_to_the_byte(picture):
    assert np.array_equal(decode_image(frame(picture.tobytes(), "bgr8")), picture)


def test_raw_grey_becomes_three_equal_channels(picture):
    grey = picture[..., 0].copy()
    assert np.array_equal(decode_image(frame(grey.tobytes(), "mono8")), np.dstack([grey] * 3))


def test_jpeg_comes_back_nearly():
    flat = np.full((6, 8, 3), 100, np.uint8)
    data = cv2.imencode(".jpg", flat)[1].tobytes()
    assert np.abs(decode_image(frame(data, "jpeg")).astype(int) - 100).max() <= 2


def test_garbage_for_jpeg_is_refused():
    with pytest.raises(ImageError, match="not a JPEG"):
        decode_image(frame(b"garbage", "jpeg"))


def test_a_jpeg_of_another_size_is_refused(picture):
    data = cv2.imencode(".jpg", picture)[1].tobytes()
    with pytest.raises(ImageError, match="8 x 6"):
        decode_image(frame(data, "jpeg", width=80, height=60))
