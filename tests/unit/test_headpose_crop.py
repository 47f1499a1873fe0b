import numpy as np
import pytest
from deixis_headpose.head_crop import INPUT_PX, HeadPlace, crop_to_picture, cut_head
from deixis_runtime.lens import Pinhole
from hypothesis import given
from hypothesis import strategies as st

CAMERA = Pinhole(500.0, 319.5, 239.5)
MIDDLE = (INPUT_PX - 1) / 2
places = st.builds(HeadPlace, st.tuples(st.floats(-50, 700), st.floats(-50, 530)), st.floats(8, 300))


def ramp() -> np.ndarray:
    """A picture whose blue tells the column and whose green tells the row."""
    rows, columns = np.mgrid[0:480, 0:640]
    return np.stack([columns * 255 / 639, rows * 255 / 479, np.full(rows.shape, 90.0)], axis=2).round().astype(np.uint8)


@given(places)
def test_the_middle_of_the_crop_is_the_middle_of_the_head(place: HeadPlace) -> None:
    x, y, w = crop_to_picture(place, CAMERA) @ np.array([MIDDLE, MIDDLE, 1.0])
    assert (x / w, y / w) == pytest.approx(place.centre_px, abs=1e-6)


@pytest.mark.parametrize("breadth_px", [20.0, 45.0, 150.0])
def test_the_crop_shows_what_the_homography_says(breadth_px: float) -> None:
    place = HeadPlace((300.0, 200.0), breadth_px)
    crop, warp = cut_head(ramp(), place, CAMERA), crop_to_picture(place, CAMERA)
    for u, v in ((10, 12), (50, 20), (32, 60)):
        x, y, w = warp @ np.array([u, v, 1.0])
        assert crop[v, u, 0] == pytest.approx(x / w * 255 / 639, abs=1.5)
        assert crop[v, u, 1] == pytest.approx(y / w * 255 / 479, abs=1.5)


def test_on_the_axis_the_crop_is_a_square_of_the_picture() -> None:
    place = HeadPlace((319.5, 239.5), 41.0)
    warp = crop_to_picture(place, CAMERA)
    left, top, w = warp @ np.array([-0.5, -0.5, 1.0])
    assert (left / w, top / w) == pytest.approx((319.5 - place.side_px / 2, 239.5 - place.side_px / 2))


def test_off_the_axis_the_picture_is_stretched_as_a_wide_lens_stretches() -> None:
    """A head 35 degrees aside covers more pixels away from the axis than across it."""
    place = HeadPlace((319.5 + 350.0, 239.5), 40.0)
    warp = crop_to_picture(place, CAMERA)
    ends = [warp @ np.array([*at, 1.0]) for at in ((0, MIDDLE), (63, MIDDLE), (MIDDLE, 0), (MIDDLE, 63))]
    (left, _), (right, _), (_, top), (_, bottom) = [(x / w, y / w) for x, y, w in ends]
    assert (right - left) / (bottom - top) == pytest.approx(np.hypot(350, 500) / 500, rel=0.02)


@given(places)
def test_heads_beyond_the_border_still_have_a_crop(place: HeadPlace) -> None:
    assert cut_head(ramp(), place, CAMERA).shape == (INPUT_PX, INPUT_PX, 3)


def test_grey_pictures_give_crops_of_three_equal_channels() -> None:
    crop = cut_head(ramp()[:, :, 0].copy(), HeadPlace((300.0, 200.0), 50.0), CAMERA)
    assert crop.shape == (INPUT_PX, INPUT_PX, 3)
    assert (crop[..., 0] == crop[..., 2]).all()
