"""Intrinsics from a ROS camera_info file or from a field of view."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from deixis_camera.calibration import AssumedFieldOfView, CalibrationError, load_calibration

ROS_FILE = """\
image_width: 640
image_height: 480
camera_name: head_camera
camera_matrix:
  rows: 3
  cols: 3
  data: [612.4, 0, 318.2, 0, 611.9, 243.7, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.021, -0.09, 0.001, -0.002, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [612.4, 0, 318.2, 0, 0, 611.9, 243.7, 0, 0, 0, 1, 0]
"""


def written(folder: Path, **changes: object) -> Path:
    path = folder / "head_camera.yaml"
    content = {**yaml.safe_load(ROS_FILE), **changes}
    path.write_text(yaml.safe_dump({key: value for key, value in content.items() if value != "absent"}))
    return path


def array(*data: float, rows: int = 1) -> dict[str, object]:
    return {"rows": rows, "cols": len(data) // rows, "data": list(data)}


def test_a_file_as_ros_writes_it_is_taken_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "head_camera.yaml"
    path.write_text(ROS_FILE)
    intrinsics = load_calibration(path).for_size(640, 480)
    assert intrinsics.camera_matrix == (612.4, 0, 318.2, 0, 611.9, 243.7, 0, 0, 1)
    assert intrinsics.distortion_model == "plumb_bob"
    assert intrinsics.distortion == (0.021, -0.09, 0.001, -0.002, 0)
    assert intrinsics.source == "calibration 'head_camera.yaml'"


def test_k_scaled_to_another_size_projects_a_point_to_the_same_place_of_the_picture(tmp_path: Path) -> None:
    calibration = load_calibration(written(tmp_path))
    point = np.array([0.3, -0.2, 1.0])
    full = np.reshape(calibration.for_size(640, 480).camera_matrix, (3, 3)) @ point
    half = np.reshape(calibration.for_size(320, 240).camera_matrix, (3, 3)) @ point
    # A pixel's centre is its origin: place (x + 1/2) / width.
    assert (half[:2] + 0.5) / [320, 240] == pytest.approx((full[:2] + 0.5) / [640, 480])
    assert "scaled from 640 x 480" in calibration.for_size(320, 240).source


def test_k_scaled_follows_the_pixels_of_a_picture_that_is_really_scaled(tmp_path: Path) -> None:
    calibration = load_calibration(written(tmp_path))
    picture = np.zeros((480, 640), np.float32)
    picture[100:108, 200:208] = 1.0  # centre at (203.5, 103.5)
    small = cv2.resize(picture, (160, 120), interpolation=cv2.INTER_AREA)
    rows, columns = np.nonzero(small)
    full, quarter = calibration.for_size(640, 480).camera_matrix, calibration.for_size(160, 120).camera_matrix
    assert (columns.mean() - quarter[2]) / quarter[0] == pytest.approx((203.5 - full[2]) / full[0])
    assert (rows.mean() - quarter[5]) / quarter[4] == pytest.approx((103.5 - full[5]) / full[4])


def test_a_picture_of_another_aspect_ratio_is_refused_with_both_sizes(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match=r"is for 640 x 480, the picture has 1280 x 720: another aspect ratio"):
        load_calibration(written(tmp_path)).for_size(1280, 720)


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [
        ("plumb_bob", array(0.1, 0, 0, 0, 0)),
        ("rational_polynomial", array(*[0.1] * 8)),
        ("rational_polynomial", array(*[0.1] * 12)),
        ("rational_polynomial", array(*[0.1] * 14)),
        ("equidistant", array(*[0.1] * 4)),
        ("", array()),
    ],
)
def test_each_model_of_ros_is_taken_with_its_own_number_of_coefficients(
    tmp_path: Path, model: str, coefficients: dict[str, object]
) -> None:
    intrinsics = load_calibration(written(tmp_path, distortion_model=model, distortion_coefficients=coefficients)).for_size(
        640, 480
    )
    assert intrinsics.distortion_model == (model or "none")
    assert list(intrinsics.distortion) == coefficients["data"]


@pytest.mark.parametrize(
    ("changes", "field", "cause"),
    [
        ({"image_width": "absent"}, "image_width", "required"),
        ({"image_height": -480}, "image_height", "greater"),
        ({"camera_matrix": array(1, 2, 3)}, "camera_matrix", "1 x 3 instead of 3 x 3"),
        ({"camera_matrix": {"rows": 3, "cols": 3, "data": [1, 2]}}, "camera_matrix", "data: 2 numbers for 3 x 3"),
        ({"camera_matrix": array(*[0] * 9, rows=3)}, "camera_matrix", "not positive"),
        ({"camera_matrix": array(1, 0, 320, 0, 1, 240, 0, 0, 1, rows=3)}, "camera_matrix", "179.64 degrees wide"),
        ({"camera_matrix": array(600, 0, math.nan, 0, 600, 240, 0, 0, 1, rows=3)}, "camera_matrix.data", "finite"),
        ({"camera_matrix": array(600, 0, 320, 0, 600, 240, 0, 0, 0, rows=3)}, "camera_matrix", "rows are not"),
        ({"camera_matrix": array(600, 0, 32000, 0, 600, 240, 0, 0, 1, rows=3)}, "camera_matrix", "principal point"),
        ({"distortion_model": "fisheye9"}, "distortion_model", "plumb_bob"),
        ({"distortion_model": "equidistant"}, "distortion_coefficients", "5 numbers, but equidistant has 4"),
        ({"distortion_coefficients": "absent"}, "distortion_coefficients", "0 numbers, but plumb_bob has 4 or 5"),
        ({"distortion_model": "absent"}, "distortion_model", "missing"),
    ],
)
def test_a_bad_field_is_named_with_the_file_and_the_cause(
    tmp_path: Path, changes: dict[str, object], field: str, cause: str
) -> None:
    path = written(tmp_path, **changes)
    with pytest.raises(CalibrationError) as refusal:
        load_calibration(path)
    assert str(path) in str(refusal.value)
    assert field in str(refusal.value)
    assert cause in str(refusal.value)


@pytest.mark.parametrize(
    ("content", "cause"),
    [(b"", "holds no fields"), (b"a: [1", "is not YAML"), (b"- 1\n- 2\n", "holds no fields"), (b"\xff\xfe\x00", "is not YAML")],
)
def test_a_file_that_is_no_camera_info_is_refused_in_one_line(tmp_path: Path, content: bytes, cause: str) -> None:
    path = tmp_path / "camera.yaml"
    path.write_bytes(content)
    with pytest.raises(CalibrationError, match=cause) as refusal:
        load_calibration(path)
    assert "\n" not in str(refusal.value)


def test_a_missing_calibration_file_is_refused_with_its_path(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match=r"nowhere.yaml' cannot be read: No such file"):
        load_calibration(tmp_path / "nowhere.yaml")


def test_an_assumed_field_of_view_is_met_and_said() -> None:
    intrinsics = AssumedFieldOfView(60.0).for_size(640, 480)
    focal, centre = intrinsics.camera_matrix[0], intrinsics.camera_matrix[2]
    left, right = math.atan((-0.5 - centre) / focal), math.atan((639.5 - centre) / focal)
    assert math.degrees(right - left) == pytest.approx(60.0)
    assert "assumed" in intrinsics.source
    assert "60 degrees" in intrinsics.source
