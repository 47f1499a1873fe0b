"""A measured lens as a ROS camera_info YAML, as camera_calibration writes it and the camera stage reads it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from deixis_camera.calibration import CalibrationError, load_calibration

from .lens_fit import LensFit


def write_camera_info(path: Path, fit: LensFit, camera_name: str, remarks: list[str]) -> None:
    """Write the lens, with remarks as comments. Raises CalibrationError where the camera stage would refuse it, or OSError.

    The file stands there whole or not at all.
    """
    part = path.with_name(f".{path.name}.part")
    comments = "".join(f"# {' '.join(line.split())}\n" for line in remarks)
    try:
        text = yaml.safe_dump(content_of(fit, camera_name), sort_keys=False, default_flow_style=None, width=120)
        part.write_text(comments + text, encoding="utf-8")
        load_calibration(part)
        os.replace(part, path)
    except CalibrationError as error:
        raise CalibrationError(str(error).replace(str(part), path.name)) from None
    finally:
        part.unlink(missing_ok=True)


def content_of(fit: LensFit, camera_name: str) -> dict[str, Any]:
    """The fields of the file. The projection matrix shows the undistorted picture's whole middle, without black borders."""
    width, height = fit.size
    shown = np.zeros((3, 4))
    given = np.array(fit.distortion)
    if fit.model == "equidistant":
        shown[:, :3] = cv2.fisheye.estimateNewCameraMatrixForUndistortRectify(fit.matrix, given, fit.size, np.eye(3), balance=0)
    else:
        shown[:, :3], _ = cv2.getOptimalNewCameraMatrix(fit.matrix, given, fit.size, 0)
    return {
        "image_width": width,
        "image_height": height,
        "camera_name": camera_name,
        "camera_matrix": _array(fit.matrix),
        "distortion_model": fit.model,
        "distortion_coefficients": _array(given[None]),
        "rectification_matrix": _array(np.eye(3)),
        "projection_matrix": _array(shown),
    }


def _array(values: np.ndarray) -> dict[str, Any]:
    rows, columns = values.shape
    return {"rows": rows, "cols": columns, "data": [round(float(value), 9) for value in values.ravel()]}
