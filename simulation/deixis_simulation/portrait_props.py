"""Glasses, and things before the face: drawn onto portraits, not rendered, which at their size looks the same."""

from __future__ import annotations

import cv2
import numpy as np

from .avatars import Picture
from .geometry import Floats, View
from .rotations import unit
from .skeleton import Skeleton

EYES = (("RightEye", -1.0), ("LeftEye", 1.0))
"""Bones, and on which side of the face they are."""
RIM_WIDE_M, RIM_HIGH_M, RIM_AHEAD_M = (0.02, 0.029), (0.014, 0.025), 0.022
"""Half sizes of a rim, and how far it is before the middle of the eye."""
TEMPLE_M = np.array([[0.03, 0.005, 0.02], [0.042, 0.004, -0.075]])
"""From the hinge to the ear, from the left eye's middle."""
DARK = 0.3
"""Share of glasses that are dark."""
SHIFT = 3
"""Bits of fractions of pixels that lines are drawn with."""


def with_glasses(rng: np.random.Generator, picture: Picture, skeleton: Skeleton, view: View) -> Picture:
    """The portrait with rims around those eyes that are seen, and the near temple of the glasses."""
    head, scale = skeleton.rotation("Head"), skeleton.body.head_scale
    toward = unit(view.centre - skeleton.position("Head")) @ head
    rim, temple = _rim(rng) * scale, TEMPLE_M * scale
    colour = tuple(int(value) for value in rng.integers(0, 90, 3))
    thick, dark = int(rng.integers(1, 3)), bool(rng.random() < DARK)
    drawn: Picture = picture.copy()
    for bone, side in EYES:
        eye = skeleton.position(bone)
        if toward[2] > -0.1 and toward @ unit([side * 0.5, 0, 1.0]) > -0.05:
            ring = view.project(eye + rim @ head.T)
            drawn = _line(_shaded(drawn, ring, colour) if dark else drawn, ring, colour, thick, closed=True)
        if toward[0] * side > 0.15:
            drawn = _line(drawn, view.project(eye + (temple * (side, 1, 1)) @ head.T), colour, thick, closed=False)
    return drawn


def with_something_before(rng: np.random.Generator, picture: Picture) -> Picture:
    """The portrait with a hand, an arm or a thing that covers a part: an ellipse, mostly of one of its colours."""
    size = picture.shape[0]
    inner = size // 5
    own = picture[tuple(rng.integers(inner, size - inner, 2))].astype(float)
    colour = own if rng.random() < 0.6 else rng.integers(0, 256, 3).astype(float)
    centre, axes = rng.uniform(0.16 * size, 0.84 * size, 2), rng.uniform(0.06 * size, 0.21 * size, 2)
    mask = np.zeros(picture.shape[:2], np.uint8)
    cv2.ellipse(mask, (centre.tolist(), (2 * axes).tolist(), float(rng.uniform(0, 180))), 255, -1)
    soft = (cv2.GaussianBlur(mask, (0, 0), 0.8) / 255.0)[..., None]
    top, bottom = (float(value) for value in rng.uniform(0.7, 1.2, 2))
    shaded = colour * np.linspace(top, bottom, size)[:, None, None]
    return np.asarray(np.clip(picture * (1 - soft) + shaded * soft, 0, 255), np.uint8)


def _rim(rng: np.random.Generator) -> Floats:
    """Outline (17, 3) of a glass, about the middle of the eye, in axes of the head."""
    angle = np.linspace(0, 2 * np.pi, 17)
    wide, high = rng.uniform(*RIM_WIDE_M), rng.uniform(*RIM_HIGH_M)
    return np.stack([wide * np.cos(angle), high * np.sin(angle), np.full(17, RIM_AHEAD_M)], axis=1)


def _line(picture: Picture, places: Floats, colour: tuple[int, ...], thick: int, *, closed: bool) -> Picture:
    points = np.round(places * 2**SHIFT).astype(np.int32)
    return np.asarray(cv2.polylines(picture, [points], closed, colour, thick, cv2.LINE_AA, SHIFT), np.uint8)


def _shaded(picture: Picture, ring: Floats, colour: tuple[int, ...]) -> Picture:
    shade = cv2.fillPoly(picture.copy(), [np.round(ring).astype(np.int32)], colour)
    return np.asarray(cv2.addWeighted(shade, 0.7, picture, 0.3, 0), np.uint8)
