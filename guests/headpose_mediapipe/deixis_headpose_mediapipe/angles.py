"""Yaw of a head from the landmarks of its face: solvePnP, and the mesh's own axes. Pure."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from deixis_runtime.lens import Pinhole
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

RIGHT_EYE, LEFT_EYE, BROW, CHIN = 33, 263, 10, 152
"""Landmarks of the mesh that span its axes: outer corners of the eyes, top and bottom of the face."""
GENERIC_HEAD_MM = {
    1: (0.0, 11.0, -75.0),
    33: (-44.0, -27.0, -32.0),
    133: (-19.0, -25.0, -37.0),
    362: (19.0, -25.0, -37.0),
    263: (44.0, -27.0, -32.0),
    61: (-25.0, 43.0, -43.0),
    291: (25.0, 43.0, -43.0),
    10: (0.0, -83.0, -45.0),
    152: (0.0, 94.0, -43.0),
}
"""Where landmarks lie on a usual head that faces along the optical axis (x right, y down, z away): nose tip, corners of the
eyes and of the mouth, top and bottom of the face. A face is 164 mm wide on it."""
SIGMA_YAWS_DEG, SIGMAS_DEG = (0.0, 30.0, 50.0, 65.0), (2.5, 3.5, 4.5, 8.0)
"""What of labelled head turns was measured."""
MOST_ROLL_DEG = 50.0
"""A mesh that lies on its side is one that has slipped: nobody visits so."""


def yaw_of(mesh: Floats, pinhole: Pinhole) -> float | None:
    """Yaw of the head under a mesh (n, 3), pixels, z in the same scale and away from the camera; none where it cannot be one.

    Relative to the line head -> camera, positive toward image right, degrees.

    Of yaws, PnP falls short by up to 7 degrees beyond 55, and the mesh's own axes exceed by up to 5: the mean is taken. Pitch
    and roll are not told: their zero is 6 to 12 degrees off, by yaw; nor is the distance: the tracker's box says it better.
    """
    solved = _solve(mesh, pinhole)
    if solved is None:
        return None
    turn, (x, z) = solved
    nose = -turn[:, 2]
    by_pnp = math.atan2(nose[0], -nose[2]) - math.atan2(-x, z)
    own = np.cross(mesh[LEFT_EYE] - mesh[RIGHT_EYE], mesh[CHIN] - mesh[BROW])
    own = own * (-1 if own[2] > 0 else 1)
    # The mesh is one of weak perspective, so its axes are relative to the line of sight already.
    by_mesh = math.atan2(own[0], -own[2])
    roll_deg = abs(math.degrees(math.atan2(turn[1, 0], turn[0, 0])))
    if z <= 0 or roll_deg > MOST_ROLL_DEG or not math.isfinite(by_pnp + by_mesh):
        return None
    apart = (by_pnp - by_mesh + math.pi) % (2 * math.pi) - math.pi
    return math.degrees(by_mesh + apart / 2)


def sigma_deg(yaw_deg: float) -> float:
    """Standard deviation of such a yaw."""
    return float(np.interp(abs(yaw_deg), SIGMA_YAWS_DEG, SIGMAS_DEG))


def _solve(mesh: Floats, pinhole: Pinhole) -> tuple[Floats, tuple[float, float]] | None:
    """Rotation of the generic head to camera axes, and how far aside and away it is, mm."""
    matrix = np.array([[pinhole.focal_px, 0, pinhole.centre_x_px], [0, pinhole.focal_px, pinhole.centre_y_px], [0, 0, 1]])
    model, pixels = np.array(list(GENERIC_HEAD_MM.values())), np.ascontiguousarray(mesh[list(GENERIC_HEAD_MM), :2])
    try:
        solved, turn, place = cv2.solvePnP(model, pixels, matrix, None, flags=cv2.SOLVEPNP_SQPNP)
    except cv2.error:  # landmarks on one line, as of a face that is cut off
        return None
    if not solved:
        return None
    x, _, z = (float(value) for value in place.ravel())
    return np.asarray(cv2.Rodrigues(turn)[0]), (x, z)
