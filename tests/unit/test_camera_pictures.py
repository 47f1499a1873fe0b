"""From whatever arrives to 8-bit grey or BGR within bounds, and to bytes."""

import cv2
import numpy as np
import pytest
from deixis_camera.pictures import Normaliser, encode
from deixis_camera.sources import PictureRefused
from deixis_runtime.images import decode_image
from deixis_schemas.messages import Frame


def gradient(width: int, height: int) -> np.ndarray:
    row = np.linspace(0, 255, width).astype(np.uint8)
    picture = np.full((height, width, 3), (0, 40, 90), np.uint8)
    picture[:, :, 0] = row
    return picture


def test_a_colour_picture_of_good_size_passes_unchanged() -> None:
    picture = gradient(640, 480)
    assert np.array_equal(Normaliser(1280).normalise(picture), picture)


def test_a_picture_with_alpha_loses_only_its_alpha() -> None:
    picture = gradient(100, 80)
    alpha = np.dstack([picture, np.full((80, 100), 7, np.uint8)])
    assert np.array_equal(Normaliser(1280).normalise(alpha), picture)


@pytest.mark.parametrize("shape", [(80, 100), (80, 100, 1)])
def test_a_grey_picture_stays_grey_and_travels_as_mono8(shape: tuple[int, ...]) -> None:
    encoded = encode(Normaliser(1280).normalise(np.full(shape, 77, np.uint8)), None)
    assert (encoded.encoding, encoded.width, encoded.height, len(encoded.data)) == ("mono8", 100, 80, 8000)


@pytest.mark.parametrize(("size", "good"), [((10, 10), False), ((63, 480), False), ((640, 63), False), ((64, 64), True)])
def test_a_picture_smaller_than_64_pixels_a_side_is_refused(size: tuple[int, int], good: bool) -> None:
    normaliser = Normaliser(1280)
    if good:
        assert normaliser.normalise(gradient(*size)).shape == (size[1], size[0], 3)
        return
    with pytest.raises(PictureRefused, match=f"{size[0]} x {size[1]} is smaller than 64"):
        normaliser.normalise(gradient(*size))


@pytest.mark.parametrize(
    ("size", "scaled"), [((7680, 4320), (1280, 720)), ((1080, 1920), (720, 1280)), ((8192, 8192), (1280, 1280))]
)
def test_a_large_picture_is_scaled_down_by_its_longer_side(size: tuple[int, int], scaled: tuple[int, int]) -> None:
    pixels = Normaliser(1280).normalise(np.full((size[1], size[0], 3), 50, np.uint8))
    assert pixels.shape == (scaled[1], scaled[0], 3)
    assert int(pixels.min()) == int(pixels.max()) == 50


def test_a_strip_that_would_be_too_narrow_when_scaled_down_is_refused() -> None:
    with pytest.raises(PictureRefused, match="too narrow"):
        Normaliser(1280).normalise(np.zeros((64, 8000, 3), np.uint8))


def test_16_bit_pictures_keep_their_brightness_at_full_scale() -> None:
    deep = gradient(100, 80).astype(np.uint16) << 8
    assert np.array_equal(Normaliser(1280).normalise(deep), gradient(100, 80))


def test_12_bits_in_a_16_bit_picture_are_not_published_as_black() -> None:
    twelve = gradient(100, 80).astype(np.uint16) << 4
    normaliser = Normaliser(1280)
    assert int(normaliser.normalise(twelve).max()) == 255
    assert normaliser.bits == 12
    dark = normaliser.normalise(twelve // 8)
    assert int(dark.max()) == 31, "a dark picture later on is dark, not brightened anew"


@pytest.mark.parametrize(
    ("picture", "cause"),
    [
        (np.zeros((80, 100, 3), np.float32), "float32 values"),
        (np.zeros((80, 100, 3), np.int16), "int16 values"),
        (np.zeros((80, 100, 2), np.uint8), "2 channels"),
        (np.zeros((80, 100, 7), np.uint8), "7 channels"),
        (np.zeros((100,), np.uint8), "1 dimensions"),
        (np.zeros((0, 0, 3), np.uint8), "smaller than 64"),
    ],
)
def test_a_picture_of_another_kind_is_refused_with_the_cause(picture: np.ndarray, cause: str) -> None:
    with pytest.raises(PictureRefused, match=cause):
        Normaliser(1280).normalise(picture)


@pytest.mark.parametrize(("quality", "error"), [(None, 0), (85, 12)])
def test_what_is_encoded_is_what_the_other_stages_decode(quality: int | None, error: int) -> None:
    picture = cv2.GaussianBlur(gradient(320, 240), (9, 9), 0)
    encoded = encode(picture, quality)
    frame = Frame(run=1, seq=0, stamp_ns=1, stage="camera", instance="a", **vars(encoded))
    assert int(np.abs(decode_image(frame).astype(int) - picture).max()) <= error


def test_a_lower_quality_makes_a_smaller_jpeg() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    sizes = [len(encode(noise, quality).data) for quality in (20, 60, 95)]
    assert sizes == sorted(sizes)
    assert sizes[0] * 2 < sizes[2]
