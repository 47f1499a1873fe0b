"""Intrinsics: from a ROS camera_info YAML, or assumed from a field of view."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Protocol

import yaml
from deixis_runtime.lens import DistortionModel, Matrix, check_matrix, same_aspect
from deixis_schemas.codec import say
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

COEFFICIENTS: dict[DistortionModel, tuple[int, ...]] = {
    "none": (0,),
    "plumb_bob": (4, 5),
    "rational_polynomial": (8, 12, 14),
    "equidistant": (4,),
}
"""Numbers of coefficients that OpenCV's models take (calib3d: 4, 5, 8, 12 or 14; fisheye: 4)."""


class CalibrationError(ValueError):
    """A calibration that cannot be used. The text names the file, the field and the cause."""


@dataclass(frozen=True)
class Intrinsics:
    """How a picture of one size projects.

    camera_matrix: K, row-major, pixels with the origin at the centre of the top left one.
    source: where it comes from, one sentence.
    """

    camera_matrix: Matrix
    distortion_model: DistortionModel
    distortion: tuple[float, ...]
    source: str


class Calibration(Protocol):
    """Gives intrinsics for any size of picture."""

    def for_size(self, width: int, height: int) -> Intrinsics:
        """Intrinsics of a picture of `width` x `height` pixels. Raises CalibrationError."""


@dataclass(frozen=True)
class AssumedFieldOfView:
    """A pinhole camera with square pixels and its axis through the picture's centre."""

    horizontal_fov_deg: float

    def for_size(self, width: int, height: int) -> Intrinsics:
        """K with focal length (width / 2) / tan(fov / 2)."""
        focal = width / 2 / math.tan(math.radians(self.horizontal_fov_deg) / 2)
        matrix = (focal, 0.0, (width - 1) / 2, 0.0, focal, (height - 1) / 2, 0.0, 0.0, 1.0)
        text = f"assumed from a horizontal field of view of {self.horizontal_fov_deg:g} degrees, without distortion"
        return Intrinsics(matrix, "none", (), text)


@dataclass(frozen=True)
class RosCalibration:
    """The content of a camera_info file: K and distortion for `width` x `height`."""

    name: str
    width: int
    height: int
    camera_matrix: Matrix
    distortion_model: DistortionModel
    distortion: tuple[float, ...]

    def for_size(self, width: int, height: int) -> Intrinsics:
        """K scaled to another size of the same aspect ratio; distortion does not depend on the size.

        Raises CalibrationError where the ratio differs: the picture is then cut, and the file does not say where.
        """
        along_x, along_y = width / self.width, height / self.height
        if not same_aspect((self.width, self.height), (width, height)):
            raise CalibrationError(
                f"calibration '{self.name}' is for {self.width} x {self.height}, the picture has {width} x {height}: "
                "another aspect ratio; calibrate at this size"
            )
        source = f"calibration '{self.name}'"
        if (width, height) != (self.width, self.height):
            source += f", scaled from {self.width} x {self.height}"
        return Intrinsics(_scaled(self.camera_matrix, along_x, along_y), self.distortion_model, self.distortion, source)


def load_calibration(path: Path) -> RosCalibration:
    """Read a ROS camera_info YAML as camera_calibration and camera_info_manager write it.

    Raises CalibrationError that names the file, the field and the cause.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CalibrationError(f"calibration '{path}' cannot be read: {error.strerror or error}") from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise CalibrationError(f"calibration '{path}' is not YAML: {' '.join(str(error).split())[:300]}") from None
    if not isinstance(content, dict):
        raise CalibrationError(f"calibration '{path}' is not a camera_info file: it holds no fields")
    try:
        info = _CameraInfoFile.model_validate(content)
    except ValidationError as error:
        raise CalibrationError(f"calibration '{path}': {say(error)}") from None
    return info.as_calibration(path.name)


class _Array(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)
    rows: int = Field(ge=1, le=16)
    cols: int = Field(ge=0, le=16)
    data: Annotated[list[float], Field(max_length=64)]

    @model_validator(mode="after")
    def _data_fills_it(self) -> _Array:
        if len(self.data) != self.rows * self.cols:
            raise ValueError(f"data: {len(self.data)} numbers for {self.rows} x {self.cols}")
        return self


class _CameraInfoFile(BaseModel):
    """Fields of the file that are used; camera_name, rectification_matrix and projection_matrix are for stereo rigs."""

    model_config = ConfigDict(allow_inf_nan=False, extra="ignore")
    image_width: int = Field(ge=1, le=65536)
    image_height: int = Field(ge=1, le=65536)
    camera_matrix: _Array
    distortion_model: DistortionModel = "none"
    distortion_coefficients: _Array | None = None

    @field_validator("distortion_model", mode="before")
    @classmethod
    def _empty_is_none(cls, value: object) -> object:
        return "none" if value in ("", None) else value

    @model_validator(mode="after")
    def _matrix_projects(self) -> _CameraInfoFile:
        matrix = self.camera_matrix
        if (matrix.rows, matrix.cols) != (3, 3):
            raise ValueError(f"camera_matrix: {matrix.rows} x {matrix.cols} instead of 3 x 3")
        a, b, c, d, e, f, g, h, i = matrix.data
        check_matrix((a, b, c, d, e, f, g, h, i), self.image_width, self.image_height)
        return self

    @model_validator(mode="after")
    def _model_has_its_coefficients(self) -> _CameraInfoFile:
        given = len(self._coefficients())
        allowed = COEFFICIENTS[self.distortion_model]
        if self.distortion_model != "none" and given not in allowed:
            wanted = " or ".join(str(number) for number in allowed)
            raise ValueError(f"distortion_coefficients: {given} numbers, but {self.distortion_model} has {wanted}")
        if self.distortion_model == "none" and any(self._coefficients()):
            raise ValueError("distortion_model: missing, but distortion_coefficients are not zero")
        return self

    def _coefficients(self) -> list[float]:
        return self.distortion_coefficients.data if self.distortion_coefficients else []

    def as_calibration(self, name: str) -> RosCalibration:
        a, b, c, d, e, f, g, h, i = self.camera_matrix.data
        distortion = () if self.distortion_model == "none" else tuple(self._coefficients())
        return RosCalibration(
            name, self.image_width, self.image_height, (a, b, c, d, e, f, g, h, i), self.distortion_model, distortion
        )


def _scaled(matrix: Matrix, along_x: float, along_y: float) -> Matrix:
    """K of the scaled picture. Half a pixel is moved first: the origin is a pixel's centre, scaling is about its corner."""
    fx, skew, cx, _, fy, cy, *_ = matrix
    moved_x, moved_y = (cx + 0.5) * along_x - 0.5, (cy + 0.5) * along_y - 0.5
    return (fx * along_x, skew * along_x, moved_x, 0.0, fy * along_y, moved_y, 0.0, 0.0, 1.0)
