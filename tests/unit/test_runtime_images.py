"""Frames become pictures, or say why not."""

import contextlib

import cv2
import numpy as np
import pytest
from deixis_runtime.images import ImageError, decode_image, jpeg_size
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


def claiming(data, width, height):
    """A JPEG whose header claims another size."""
    at = next(at for at in range(2, len(data)) if data[at] == 0xFF and data[at + 1] in (0xC0, 0xC2))
    return data[: at + 5] + height.to_bytes(2) + width.to_bytes(2) + data[at + 9 :]


def test_a_jpeg_that_claims_a_huge_picture_is_refused_before_it_is_decoded(picture, monkeypatch):
    bomb = claiming(cv2.imencode(".jpg", picture)[1].tobytes(), 65500, 65500)
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("it was decoded"))
    with pytest.raises(ImageError, match="a JPEG of 65500 x 65500 in a frame of 8 x 6"):
        decode_image(frame(bomb, "jpeg"))


@pytest.mark.parametrize("options", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1], [cv2.IMWRITE_JPEG_RST_INTERVAL, 1]])
def test_the_size_is_read_from_the_header(options):
    picture = np.zeros((37, 123), np.uint8)
    assert jpeg_size(cv2.imencode(".jpg", picture, options)[1].tobytes()) == (123, 37)


def test_segments_before_the_header_are_passed_over(picture):
    data = cv2.imencode(".jpg", picture)[1].tobytes()
    exif = b"\xff\xe1" + (70).to_bytes(2) + b"\xff\xc0" + bytes(66)
    assert jpeg_size(data[:2] + exif + b"\xff\xff" + data[2:]) == (8, 6)


@pytest.mark.parametrize("cut", range(0, 160, 7))
def test_a_jpeg_without_its_header_is_none(picture, cut):
    data = cv2.imencode(".jpg", picture)[1].tobytes()
    assert data.index(b"\xff\xc0") > 153
    with pytest.raises(ImageError, match="not a JPEG"):
        jpeg_size(data[:cut])


def test_noise_is_read_without_a_hang_or_another_error():
    noise = np.random.default_rng(5)
    for _ in range(300):
        with contextlib.suppress(ImageError):
            assert len(jpeg_size(b"\xff\xd8\xff" + noise.integers(192, 256, 200, np.uint8).tobytes())) == 2
