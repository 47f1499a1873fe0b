"""Tracks that keep to the contract and yet show no head: what starts from the front neither ends nor takes much memory."""

import tracemalloc
from itertools import product

import numpy as np
import pytest
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_headpose.patch import pyramid
from deixis_runtime.lens import Lens
from deixis_schemas.messages import FrontalFace, HeadPose
from painted_head import CAMERA, LENS, SIZE, face_of, painted_head, turned_to
from pydantic import ValidationError

METHODS = ("ellipsoid", "affine")
FRAME_NS = 33_333_333
POSE = turned_to(0.0)
PICTURE = painted_head(POSE)
CENTRE = (CAMERA.centre_x_px, CAMERA.centre_y_px)


def lens_of(focal_px: float) -> Lens:
    return Lens(*SIZE, (focal_px, focal_px, *CENTRE))


def said_of(method: str, width_px: float, lenses: list[Lens], **settings: float) -> list[HeadPose]:
    """The answers to a still head whose face is told to be so wide from the front, a frame through each lens."""
    estimator = HeadPoseEstimator(HeadposeConfig.model_validate({"method": method, **settings}))
    track = face_of(POSE).model_copy(update={"frontal": FrontalFace(centre_px=CENTRE, width_px=width_px)})
    return [estimator.update(PICTURE, [track], lens, 1, k * FRAME_NS)[0] for k, lens in enumerate(lenses)]


@pytest.mark.parametrize(("method", "width_px"), list(product(METHODS, (0.3, 0.7, 1.0, 7.9, 3000.0, 8192.0))))
def test_a_face_told_to_be_wider_or_narrower_than_any_starts_no_head(method: str, width_px: float) -> None:
    assert {pose.status for pose in said_of(method, width_px, [LENS] * 5)} == {"initialising"}


@pytest.mark.parametrize("method", METHODS)
def test_through_a_lens_of_one_pixel_no_head_is_seen(method: str) -> None:
    assert {pose.status for pose in said_of(method, 46.0, [lens_of(1.0)] * 5)} == {"initialising"}


@pytest.mark.parametrize(("method", "focal_px"), list(product(METHODS, (1.0, 1e6))))
def test_a_lens_that_changes_out_of_all_reason_ends_no_head_that_was_started(method: str, focal_px: float) -> None:
    said = said_of(method, 46.0, [LENS] * 4 + [lens_of(focal_px)] * 30 + [LENS] * 6)
    assert said[3].status == "tracking"
    assert said[-1].status == "tracking"


@pytest.mark.parametrize("method", METHODS)
def test_a_face_that_a_long_lens_sees_thousands_of_pixels_wide_takes_little_memory(method: str) -> None:
    tracemalloc.start()
    try:
        said = said_of(method, 3000.0, [lens_of(1e5)] * 3)
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert said[-1].status == "tracking", "five metres away it is a face"
    assert peak_bytes < 50e6


@pytest.mark.parametrize("levels", range(1, 6))
@pytest.mark.parametrize("width_px", [0.01, 1.0, 9.0, 120.0, 130.0, 700.0, 1e5])
def test_a_pyramid_has_all_its_levels_and_a_bounded_size_however_wide_the_head(width_px: float, levels: int) -> None:
    made = pyramid(PICTURE, CENTRE, width_px, 64.0, levels)
    assert len(made) == levels
    assert all(min(level.planes.shape[:2]) >= 2 for level in made)
    assert max(made[0].planes.shape[:2]) <= 200


@pytest.mark.parametrize("corner", [(0.0, 0.0), (-300.0, 500.0), CENTRE])
@pytest.mark.parametrize("width_px", [100.0, 200.0, 300.0])
def test_a_wide_head_is_seen_where_it_is(width_px: float, corner: tuple[float, float]) -> None:
    """Shrunk by whole pixels first: of a picture whose grey tells the place, the place can be read anywhere in it."""
    x, y = np.meshgrid(np.arange(800.0), np.arange(800.0))
    middle = (corner[0] + 400, corner[1] + 400)
    places = np.array(middle) + np.array([[0.0, 0.0], [31.0, -17.0], [-40.0, 25.0]])
    places = np.clip(places, 40, 760)
    for picture, true in ((x / 4, places[:, 0] / 4), (y / 4, places[:, 1] / 4)):
        level = pyramid(np.rint(picture).astype(np.uint8), middle, width_px, 32.0, 3)[0]
        assert level.sample(places)[0] == pytest.approx(true, abs=0.6)


def test_where_nothing_is_looked_for_nothing_is_sampled() -> None:
    values, gradients, inside = pyramid(PICTURE, CENTRE, 46.0, 64.0, 1)[0].sample(np.zeros((0, 2)))
    assert (values.shape, gradients.shape, inside.shape) == ((0,), (0, 2), (0,))


@pytest.mark.parametrize("axes", [(-1.0, 0.0, 1.0), (0.08, 0.115, 0.0), (0.08, 1.0, 0.085), (0.0, 0.1, 0.1)])
def test_an_ellipsoid_that_is_no_head_is_refused_by_the_name_of_its_setting(axes: tuple[float, float, float]) -> None:
    with pytest.raises(ValidationError, match="head_semi_axes_m"):
        HeadposeConfig(head_semi_axes_m=axes)
