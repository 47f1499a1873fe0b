"""The picture around one head as the regression sees it: a virtual camera that looks straight at the head."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from deixis_runtime.lens import Pinhole
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import Point
from numpy.typing import NDArray

from .head import Array, facing_camera

INPUT_PX = 64
CROP_M = 0.32
"""The crop is a square of so many pixels and, for a head of mean breadth, of so many metres at its distance."""
COARSE = 1.6
"""Crops from more pixels than this, a pixel, are shrunk before they are warped, or they would be grainy."""


@dataclass(frozen=True)
class HeadPlace:
    """Where a head is in the picture: its middle, and the width of its face as from the front (FACE_WIDTH_M), pixels."""

    centre_px: Point
    face_width_px: float

    @property
    def side_px(self) -> float:
        """Side of the crop about it, pixels."""
        return self.face_width_px * CROP_M / FACE_WIDTH_M


def ray_to(centre_px: Point, camera: Pinhole) -> Array:
    """Line of sight (3,) to a pixel: x / z, y / z, 1."""
    x = (centre_px[0] - camera.centre_x_px) / camera.focal_px
    y = (centre_px[1] - camera.centre_y_px) / camera.focal_px
    return np.array([x, y, 1.0])


def cut_head(picture: NDArray[np.uint8], place: HeadPlace, camera: Pinhole) -> NDArray[np.uint8]:
    """The crop (INPUT_PX, INPUT_PX, 3) about a head, BGR; beyond the picture its border is repeated.

    It is what a camera would see that is turned toward the head without roll: off the axis of a wide lens a head looks
    stretched and turned, by as much as its place says, and the regression need not learn that.
    """
    warp = crop_to_picture(place, camera)
    cut, warp = _shrunk(picture, place, warp)
    crop = cv2.warpPerspective(
        cut, warp, (INPUT_PX, INPUT_PX), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(cv2.cvtColor(crop, cv2.COLOR_GRAY2BGR) if crop.ndim == 2 else crop, np.uint8)


def crop_to_picture(place: HeadPlace, camera: Pinhole) -> Array:
    """Homography (3, 3) from pixels of the crop to those of the picture."""
    ray = ray_to(place.centre_px, camera)
    scale = place.side_px / INPUT_PX / (camera.focal_px * float(np.linalg.norm(ray)))
    middle = (INPUT_PX - 1) / 2
    to_ray = np.array([[scale, 0.0, -middle * scale], [0.0, scale, -middle * scale], [0.0, 0.0, 1.0]])
    focal = camera.focal_px
    of_camera = np.array([[focal, 0.0, camera.centre_x_px], [0.0, focal, camera.centre_y_px], [0.0, 0.0, 1.0]])
    return np.asarray(of_camera @ facing_camera(ray) @ to_ray)


def _shrunk(picture: NDArray[np.uint8], place: HeadPlace, warp: Array) -> tuple[NDArray[np.uint8], Array]:
    """The part of the picture about the head, shrunk where the crop is much coarser, and the homography to its pixels."""
    half = int(np.ceil(0.8 * place.side_px))
    height, width = picture.shape[:2]
    left, right = (int(np.clip(place.centre_px[0] + d, 0, width - 1)) for d in (-half, half))
    top, bottom = (int(np.clip(place.centre_px[1] + d, 0, height - 1)) for d in (-half, half))
    cut = picture[top : bottom + 1, left : right + 1]
    share = min(1.0, COARSE * INPUT_PX / place.side_px)
    across, down = max(1, round(cut.shape[1] * share)), max(1, round(cut.shape[0] * share))
    if share < 1.0:
        cut = np.asarray(cv2.resize(cut, (across, down), interpolation=cv2.INTER_AREA), np.uint8)
    x, y = across / (right - left + 1), down / (bottom - top + 1)
    # Pixel centres are at integers, so the half pixel moves as well.
    into = np.array([[x, 0.0, (0.5 - left) * x - 0.5], [0.0, y, (0.5 - top) * y - 0.5], [0.0, 0.0, 1.0]])
    return cut, into @ warp
