"""The lens behind pictures of a board: OpenCV's bundle adjustment, without the pictures that do not fit the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from .boards import Board
from .coverage import spread_deg
from .sightings import Sighting

Model = Literal["plumb_bob", "rational_polynomial", "equidistant"]
MODELS: tuple[Model, ...] = get_args(Model)
FEWEST_PICTURES = 3
"""Of a plane: two give the focal length under luck alone."""
ODD_TIMES, ODD_LEAST_PX = 3.0, 1.0
"""A picture whose error is so many times the median, and so large, was blurred, or its board bent: it is left out."""
FLAGS: dict[Model, int] = {
    # As camera_calibration has it by default: k3 of some twenty pictures is mostly noise, and bends the picture's corners.
    "plumb_bob": cv2.CALIB_FIX_K3,
    "rational_polynomial": cv2.CALIB_RATIONAL_MODEL,
    "equidistant": cv2.fisheye.CALIB_RECOMPUTE_EXTRINSIC | cv2.fisheye.CALIB_FIX_SKEW,
}
COEFFICIENTS: dict[Model, int] = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}


class LensFitError(ValueError):
    """Pictures that no lens can be told from; the text says why."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """One picture as the lens explains it: residual_px (n, 2), corners seen less corners expected; normal (3) of the board,
    a unit vector before the camera.
    """

    sighting: Sighting
    residual_px: NDArray[np.float64]
    normal: NDArray[np.float64]

    @property
    def rms_px(self) -> float:
        """Root mean square of the corners' distances."""
        return rms(self.residual_px)


@dataclass(frozen=True, eq=False)
class LensFit:
    """A lens: K (3, 3) for pictures of `size`, coefficients of `model`; the pictures it was told from, and those left out.

    focal_sigma: relative standard deviation of the focal length; none where the fit does not tell.
    """

    size: tuple[int, int]
    model: Model
    matrix: NDArray[np.float64]
    distortion: tuple[float, ...]
    pictures: tuple[Fitted, ...]
    odd: tuple[Fitted, ...]
    focal_sigma: float | None

    @property
    def rms_px(self) -> float:
        """Over all corners of the pictures that count."""
        return rms(np.concatenate([picture.residual_px for picture in self.pictures]))

    @property
    def tilt_deg(self) -> float:
        """The largest angle between two boards of the pictures that count, as this lens has it."""
        return spread_deg(np.array([picture.normal for picture in self.pictures]))

    @property
    def horizontal_fov_deg(self) -> float:
        """How wide the view is, by the focal length."""
        return 2 * math.degrees(math.atan(self.size[0] / 2 / float(self.matrix[0, 0])))


def rms(residual_px: NDArray[np.float64]) -> float:
    """Root mean square of the lengths of (n, 2)."""
    return float(np.sqrt(np.mean(np.sum(residual_px**2, axis=1))))


def fit_lens(board: Board, sightings: Sequence[Sighting], model: Model) -> LensFit:
    """The lens that explains these pictures best. Raises LensFitError."""
    _check(sightings)
    fit = _fitted(board, sightings, model)
    limit = max(ODD_LEAST_PX, ODD_TIMES * median(picture.rms_px for picture in fit.pictures))
    odd = tuple(picture for picture in fit.pictures if picture.rms_px > limit)
    if not odd or len(fit.pictures) - len(odd) < FEWEST_PICTURES:
        return fit
    kept = [picture.sighting for picture in fit.pictures if picture.rms_px <= limit]
    again = _fitted(board, kept, model)
    return LensFit(fit.size, model, again.matrix, again.distortion, again.pictures, odd, again.focal_sigma)


def _check(sightings: Sequence[Sighting]) -> None:
    if len(sightings) < FEWEST_PICTURES:
        raise LensFitError(
            f"the board is seen in {len(sightings)} pictures: {FEWEST_PICTURES} are the fewest, 15 to 40 are good"
        )
    sizes = sorted({sighting.size for sighting in sightings})
    if len(sizes) > 1:
        listed = ", ".join(f"{width} x {height}" for width, height in sizes)
        raise LensFitError(f"pictures are of different sizes ({listed}): a lens is measured at one")


def _fitted(board: Board, sightings: Sequence[Sighting], model: Model) -> LensFit:
    size = sightings[0].size
    try:
        matrix, given, poses, sigma = _solved(board, sightings, model)
    except cv2.error as error:
        raise LensFitError(f"no lens fits these pictures: {error.err or error.msg}") from None
    distortion = tuple(float(value) for value in np.ravel(given)[: COEFFICIENTS[model]])
    if not (np.isfinite(matrix).all() and all(map(math.isfinite, distortion)) and min(matrix[0, 0], matrix[1, 1]) > 0):
        raise LensFitError("no lens fits these pictures: the focal length is not a number; were all at the same tilt?")
    pictures = tuple(
        Fitted(
            sighting,
            sighting.px - _projected(sighting.corner_m(board), pose, matrix, distortion, model),
            np.asarray(cv2.Rodrigues(pose[0])[0][:, 2], np.float64),
        )
        for sighting, pose in zip(sightings, poses, strict=True)
    )
    return LensFit(size, model, matrix, distortion, pictures, (), sigma)


Pose = tuple[NDArray[np.float64], NDArray[np.float64]]


def _solved(
    board: Board, sightings: Sequence[Sighting], model: Model
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[Pose], float | None]:
    """K, coefficients, the board's turn and place in each picture, and the focal length's relative standard deviation."""
    places = [sighting.corner_m(board)[:, None].astype(np.float64) for sighting in sightings]
    seen = [sighting.px[:, None].astype(np.float64) for sighting in sightings]
    size, start = sightings[0].size, np.eye(3)
    if model == "equidistant":
        _, matrix, given, turns, shifts = cv2.fisheye.calibrate(places, seen, size, start, np.zeros(4), flags=FLAGS[model])
        return np.asarray(matrix, np.float64), np.asarray(given, np.float64), _poses(turns, shifts), None
    _, matrix, given, turns, shifts, spread, _, _ = cv2.calibrateCameraExtended(
        [place.astype(np.float32) for place in places],
        [corners.astype(np.float32) for corners in seen],
        size,
        start,
        np.zeros(5),
        flags=FLAGS[model],
    )
    sigma = float(np.ravel(spread)[0] / matrix[0, 0])
    return np.asarray(matrix, np.float64), np.asarray(given, np.float64), _poses(turns, shifts), sigma


def _poses(turns: Sequence[NDArray], shifts: Sequence[NDArray]) -> list[Pose]:
    return [(np.ravel(turn), np.ravel(shift)) for turn, shift in zip(turns, shifts, strict=True)]


def _projected(
    places: NDArray, pose: Pose, matrix: NDArray[np.float64], distortion: tuple[float, ...], model: Model
) -> NDArray[np.float64]:
    """Where corners (n, 3) of a board in that pose are expected (n, 2)."""
    corners, given = places[:, None].astype(np.float64), np.array(distortion)
    if model == "equidistant":
        px, _ = cv2.fisheye.projectPoints(corners, pose[0], pose[1], matrix, given)
    else:
        px, _ = cv2.projectPoints(corners, pose[0], pose[1], matrix, given)
    return np.asarray(px, np.float64).reshape(-1, 2)
