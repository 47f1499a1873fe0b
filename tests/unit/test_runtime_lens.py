"""The lens against OpenCV's own projection, with every number of coefficients that a calibration may have."""

import cv2
import numpy as np
import pytest
from deixis_runtime.lens import Lens, LensError
from deixis_schemas.messages import CameraInfo

SIZE = (640, 480)
MATRIX = (560.0, 0.0, 330.0, 0.0, 555.0, 236.0, 0.0, 0.0, 1.0)
PLUMB_BOB = [0.05, -0.1, 0.002, -0.001, 0.02]
RATIONAL = [*PLUMB_BOB, 0.03, 0.01, -0.004]
PRISM = [*RATIONAL, 0.01, -0.004, -0.006, 0.003]
TILTED = [*PRISM, 0.04, -0.03]
POINTS = [(-0.4, -0.3), (0.0, 0.0), (0.3, -0.2), (0.45, 0.35)]


def camera_info(model="none", distortion=()):
    return CameraInfo(
        stamp_ns=0, stage="camera", instance="c", state="streaming", source="0", width=SIZE[0], height=SIZE[1],
        camera_matrix=MATRIX, distortion_model=model, distortion=list(distortion),
    )  # fmt: skip


def seen_at(x, y, distortion):
    pixels, _ = cv2.projectPoints(np.array([[x, y, 1.0]]), np.zeros(3), np.zeros(3), np.reshape(MATRIX, (3, 3)), distortion)
    return tuple(float(v) for v in pixels.ravel())


@pytest.mark.parametrize("distortion", [PLUMB_BOB[:4], PLUMB_BOB, RATIONAL, PRISM, TILTED], ids=len)
def test_a_distorted_pixel_leads_back_to_its_direction(distortion):
    model = "plumb_bob" if len(distortion) <= 5 else "rational_polynomial"
    lens = Lens.of(camera_info(model, distortion))
    for point in POINTS:
        assert lens.ray(seen_at(*point, np.array(distortion)), SIZE) == pytest.approx(point, abs=2e-4)


def test_a_fisheye_pixel_leads_back_to_its_direction():
    distortion = [0.02, -0.01, 0.003, -0.001]
    lens = Lens.of(camera_info("equidistant", distortion))
    points = np.array(POINTS, float).reshape(-1, 1, 2)
    pixels = cv2.fisheye.distortPoints(points, np.reshape(MATRIX, (3, 3)), np.array(distortion))
    for pixel, point in zip(pixels.reshape(-1, 2), POINTS, strict=True):
        assert lens.ray(tuple(pixel), SIZE) == pytest.approx(point, abs=1e-6)


def test_a_picture_of_half_the_size_shows_the_same_directions():
    lens = Lens.of(camera_info("plumb_bob", PLUMB_BOB))
    assert lens.ray((99.5, 59.5), (320, 240)) == pytest.approx(lens.ray((199.5, 119.5), SIZE))
    assert lens.focal_x_px((320, 240)) == pytest.approx(280)


def test_without_distortion_the_local_pinhole_is_the_camera():
    square = camera_info().model_copy(update={"camera_matrix": (560.0, 0.0, 330.0, 0.0, 560.0, 236.0, 0.0, 0.0, 1.0)})
    assert Lens.of(square).pinhole_at((40.0, 400.0), SIZE) == pytest.approx((560.0, 330.0, 236.0), abs=1e-6)


def test_the_local_pinhole_of_a_distorted_lens_shows_a_pixel_where_it_is():
    lens = Lens.of(camera_info("plumb_bob", [-0.3, 0.08, 0.0, 0.0, 0.0]))
    pixel = (600.0, 60.0)
    pinhole, (x, y) = lens.pinhole_at(pixel, SIZE), lens.ray(pixel, SIZE)
    assert (pinhole.focal_px * x + pinhole.centre_x_px, pinhole.focal_px * y + pinhole.centre_y_px) == pytest.approx(pixel)
    assert pinhole.focal_px < 540  # a barrel shows things smaller at its rim


def test_an_assumed_field_of_view_spans_the_picture():
    lens = Lens.assumed(640, 480, 60.0)
    assert lens.ray((-0.5, 239.5), SIZE)[0] == pytest.approx(-np.tan(np.radians(30)))


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        (None, "no intrinsics yet"),
        (dict.fromkeys(range(9), 0.0), "not positive"),
        ({0: -560.0}, "not positive"),
        ({0: 1.0, 4: 1.0}, r"focal length of 1 pixels is a view 179.64 degrees wide; 5 to 170 can be"),
        ({0: 27.0, 4: 27.0}, "view 170.35 degrees wide"),
        ({0: 1e9, 4: 1e9}, "degrees wide"),
        ({0: 7400.0, 4: 7400.0}, "view 4.9522 degrees wide"),
        ({4: 100.0}, "too far apart"),
        ({8: 0.0}, "rows are not"),
        ({2: 3200.0}, "principal point"),
        ({2: 1e300}, "principal point"),
    ],
)
def test_a_camera_without_intrinsics_that_can_be_is_no_lens(changed, why):
    matrix = None if changed is None else tuple(changed.get(index, value) for index, value in enumerate(MATRIX))
    with pytest.raises(LensError, match=f"camera_matrix: .*{why}"):
        Lens.of(camera_info().model_copy(update={"camera_matrix": matrix}))


@pytest.mark.parametrize("horizontal_fov_deg", [5.0, 10.0, 60.0, 120.0, 170.0])
def test_every_lens_that_may_be_assumed_is_one_that_can_be(horizontal_fov_deg):
    focal, _, cx, cy = Lens.assumed(*SIZE, horizontal_fov_deg).matrix
    told = camera_info().model_copy(update={"camera_matrix": (focal, 0.0, cx, 0.0, focal, cy, 0.0, 0.0, 1.0)})
    assert Lens.of(told) == Lens.assumed(*SIZE, horizontal_fov_deg)


def test_a_matrix_for_pictures_of_no_size_is_no_lens():
    with pytest.raises(LensError, match="pictures of 0 x 480"):
        Lens.of(camera_info().model_copy(update={"width": 0}))
