"""Pictures of a board as a camera of known lens takes them: each pixel of the picture is traced back through the lens."""

import math
from functools import cache

import cv2
import numpy as np
from deixis_calibration.sightings import Sighting

SIZE = (640, 480)
MATRIX = np.array([[560.0, 0, 325.0], [0, 558.0, 236.0], [0, 0, 1]])
DISTORTION = np.array([-0.21, 0.06, 0.001, -0.0008, 0.0])
SQUARE_PX = 60
MARGIN_PX = 40
# x, y of the board's middle as shares of the picture, distance in board widths at which it fills it, leans about x and y, roll.
VIEWS = [
    (0.5, 0.5, 1.1, 0, 0, 0),
    (0.3, 0.3, 1.5, 35, 0, 5),
    (0.7, 0.3, 1.5, -30, 15, -5),
    (0.3, 0.7, 1.5, 0, 35, 0),
    (0.7, 0.7, 1.5, 10, -35, 10),
    (0.5, 0.5, 1.2, 40, 10, -15),
    (0.5, 0.5, 1.2, -40, -10, 15),
    (0.25, 0.5, 1.7, 25, 30, 0),
    (0.75, 0.5, 1.7, -25, -30, 0),
    (0.5, 0.25, 1.6, 30, -20, 30),
    (0.5, 0.75, 1.6, -30, 20, -30),
    (0.4, 0.6, 1.3, 15, 40, 20),
]


def views(board, chosen=VIEWS, seed=0):
    """Pictures of the board, (480, 640), a little blurred and noisy."""
    rng = np.random.default_rng(seed)
    return [view(board, rng, *where) for where in chosen]


def view(board, rng, across, down, far, lean_x, lean_y, roll):
    face = cv2.copyMakeBorder(board.draw(SQUARE_PX), *[MARGIN_PX] * 4, cv2.BORDER_CONSTANT, value=255)
    px_per_m = SQUARE_PX / board.square_m
    rays = _rays()
    turn, shift = pose(board, across, down, far, lean_x, lean_y, roll)
    # A ray meets the board where turn @ (x, y, 0) + shift is along it.
    to_board = np.linalg.inv(np.column_stack([turn[:, 0], turn[:, 1], shift]))
    on_board = np.column_stack([rays, np.ones(len(rays))]) @ to_board.T
    places = on_board[:, :2] / on_board[:, 2:] * px_per_m + MARGIN_PX - 0.5
    picture = cv2.remap(
        face, *places.astype(np.float32).reshape(SIZE[1], SIZE[0], 2).transpose(2, 0, 1), cv2.INTER_AREA, borderValue=110
    )
    smooth = cv2.GaussianBlur(picture, (0, 0), 0.8).astype(np.float64)
    return np.clip(smooth * 0.8 + 20 + rng.normal(0, 2, smooth.shape), 0, 255).astype(np.uint8)


def sightings(board, chosen=VIEWS, noise_px=0.1, seed=0):
    """What a finder would see in these pictures, without making them; boards may reach out of the picture."""
    rng = np.random.default_rng(seed)
    seen = []
    for number, where in enumerate(chosen):
        turn, shift = pose(board, *where)
        on_board = board.corner_m + np.array([board.square_m, board.square_m, 0])
        corners, _ = cv2.projectPoints(on_board, turn, shift, MATRIX, DISTORTION)
        px = corners.reshape(-1, 2) + rng.normal(0, noise_px, (board.corners, 2))
        inside = ((px > 0) & (px < np.array(SIZE) - 1)).all(axis=1)
        seen.append(Sighting(f"view{number}", SIZE, np.flatnonzero(inside), px[inside].astype(np.float32)))
    return seen


def pose(board, across, down, far, lean_x, lean_y, roll):
    """Turn (3, 3) and shift (3) that bring the board before the camera."""
    turn = _turn(lean_x, lean_y, roll)
    distance = far * max(board.size_m[0] * MATRIX[0, 0] / SIZE[0], board.size_m[1] * MATRIX[1, 1] / SIZE[1])
    middle = np.linalg.inv(MATRIX) @ (across * SIZE[0], down * SIZE[1], 1) * distance
    return turn, middle - turn @ np.array([*np.array(board.size_m) / 2, 0])


@cache
def _rays():
    pixels = np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), -1).reshape(-1, 1, 2).astype(np.float64)
    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-9)
    return cv2.undistortPointsIter(pixels, MATRIX, DISTORTION, np.eye(3), np.eye(3), criteria).reshape(-1, 2)


def _turn(lean_x, lean_y, roll):
    x, y, z = (math.radians(angle) for angle in (lean_x, lean_y, roll))
    return cv2.Rodrigues(np.array([x, 0, 0]))[0] @ cv2.Rodrigues(np.array([0, y, 0]))[0] @ cv2.Rodrigues(np.array([0, 0, z]))[0]
