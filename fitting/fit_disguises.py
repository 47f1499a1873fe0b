"""Hair, beards, hoods and arms before the face that no avatar has, drawn onto portraits.

The avatars' hair is nearly the same on both sides. A network that was fitted on it took the side on which hair hides a real
signer's ear for a turn of 20 degrees; and an arm across the face, for a face that looks elsewhere.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
HEAD_BREADTH_M = 0.15
"""Ear to ear of the head that the outlines below are given for."""
CURTAIN, FRINGE, BEARD, HOOD, ARM = 0.25, 0.15, 0.12, 0.2, 0.2
"""Shares of crops with hair down one side, hair over the forehead, a beard, a hood or hair all around, an arm across."""
SIDE_SEEN, FRONT_SEEN = -0.35, -0.1
FACE_SEEN = 0.35
"""What is drawn has to face the camera by more than this cosine; a hood leaves nothing but the face to be read."""
SHIFT = 4
"""Bits of fractions of pixels that polygons are drawn with."""


def disguised(
    picture: NDArray[np.uint8],
    rotation: Floats,
    centre_px: Floats,
    breadth_px: float,
    crown_px: Floats,
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    """The portrait with any of them, as often as not; axes of the head as in deixis_headpose/head.py."""
    side = rng.choice([-1.0, 1.0])
    seen = -rotation[2]  # cosine of each axis of the head with the direction to the camera
    colour = _hair_colour(picture, centre_px, crown_px)
    outlines = []
    if rng.random() < CURTAIN and side * seen[0] > SIDE_SEEN:
        outlines.append((_curtain(side, rng), 1.0))
    if rng.random() < FRINGE and -seen[2] > FRONT_SEEN:
        outlines.append((_fringe(side, rng), 1.0))
    if rng.random() < BEARD and -seen[2] > FRONT_SEEN:
        outlines.append((_beard(rng), float(rng.uniform(0.3, 0.9))))
    for outline, cover in outlines:
        places = centre_px + breadth_px / HEAD_BREADTH_M * (outline @ rotation.T)[:, :2]
        picture = _painted(picture, places, colour, cover, rng)
    if rng.random() < HOOD and -seen[2] > FACE_SEEN:
        picture = _hooded(picture, rotation, centre_px, breadth_px / HEAD_BREADTH_M, colour, rng)
    return _crossed(picture, centre_px, breadth_px, rng) if rng.random() < ARM else picture


def _hooded(
    picture: NDArray[np.uint8], rotation: Floats, centre_px: Floats, px_per_m: float, hair: Floats, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """A blob of any shape about the head with nothing left open but the face."""
    half = np.array([(0.035, -0.065, -0.085), (0.06, -0.03, -0.06), (0.062, 0.03, -0.055), (0.045, 0.09, -0.065)])
    half = half * (rng.uniform(0.85, 1.15), rng.uniform(0.9, 1.1), 1)
    oval = np.array([*half, (0.0, 0.125, -0.085), *(half * (-1, 1, 1))[::-1]]) + rng.normal(0, 0.003, (9, 3))
    middle, axes = centre_px + px_per_m * rng.normal(0, 0.02, 2), px_per_m * rng.uniform(0.085, 0.16, 2) * (1, 1.25)
    around = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    bumps = rng.uniform(0.85, 1.15, 12)[:, None]
    outline = middle + bumps * axes * np.stack([np.cos(around), np.sin(around)], axis=1)
    colour = hair if rng.random() < 0.5 else rng.uniform(0, 255, 3)
    hooded = _painted(picture, outline, colour, 1.0, rng)
    face = np.zeros(picture.shape[:2], np.uint8)
    places = centre_px + px_per_m * (oval @ rotation.T)[:, :2]
    cv2.fillPoly(face, [np.round(places * 2**SHIFT).astype(np.int32)], 255, cv2.LINE_AA, SHIFT)
    open_ = (cv2.GaussianBlur(face, (0, 0), 0.7) / 255.0)[..., None]
    return np.clip(picture * open_ + hooded * (1 - open_), 0, 255).astype(np.uint8)


def _crossed(picture: NDArray[np.uint8], centre_px: Floats, breadth_px: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """An arm from a border of the crop to somewhere before the head, with a hand at its end; skin or sleeve."""
    angle = rng.uniform(-0.25 * np.pi, 1.25 * np.pi)  # from either side or from below, y points down
    start = centre_px + 2.5 * breadth_px * np.array([np.cos(angle), np.sin(angle)])
    end = centre_px + rng.normal(0, 0.5, 2) * breadth_px
    skin = picture[tuple(np.clip(np.round(centre_px[::-1] + rng.normal(0, 4, 2)), 0, len(picture) - 1).astype(int))].astype(
        float
    )
    sleeve = skin if rng.random() < 0.5 else rng.uniform(0, 255, 3)
    along = (end - start) / np.linalg.norm(end - start)
    across = np.array([-along[1], along[0]]) * breadth_px
    wide, narrow, hand = rng.uniform(0.25, 0.4), rng.uniform(0.14, 0.24), rng.uniform(0.2, 0.32)
    arm = np.array([start + wide * across, end + narrow * across, end - narrow * across, start - wide * across])
    picture = _painted(picture, arm, sleeve, 1.0, rng, rough=0.08)
    around = np.linspace(0, 2 * np.pi, 10, endpoint=False)
    fist = end + hand * breadth_px * rng.uniform(0.7, 1.3, (10, 1)) * np.stack([np.cos(around), np.sin(around)], axis=1)
    return _painted(picture, fist, skin, 1.0, rng, rough=0.08)


def _curtain(side: float, rng: np.random.Generator) -> Floats:
    """Down one side, from the parting over temple and ear to somewhere between jaw and shoulder."""
    inward, low = rng.uniform(0, 0.04), rng.uniform(0.03, 0.2)
    parting = rng.uniform(-0.03, 0.04)
    outline = [
        (parting, -0.115, -0.05), (0.05 - inward, -0.07, -0.08), (0.07 - inward, -0.02, -0.07),
        (0.066 - 0.7 * inward, low / 2, -0.07), (0.075, low, -0.04), (0.088, low, 0.05), (0.09, 0.0, 0.06), (0.06, -0.1, 0.03),
    ]  # fmt: skip
    return np.array(outline) * (side, 1, 1) + rng.normal(0, 0.004, (len(outline), 3))


def _fringe(side: float, rng: np.random.Generator) -> Floats:
    low, parting = rng.uniform(-0.06, -0.015), rng.uniform(-0.05, 0.03)
    outline = [
        (parting, -0.115, -0.06), (parting, low - 0.03, -0.095), (0.03, low, -0.1), (0.068, low + 0.02, -0.06),
        (0.07, -0.08, -0.03),
    ]  # fmt: skip
    return np.array(outline) * (side, 1, 1) + rng.normal(0, 0.004, (len(outline), 3))


def _beard(rng: np.random.Generator) -> Floats:
    high = rng.uniform(0.0, 0.04)
    half = [(0.066, high, -0.03), (0.058, 0.09, -0.055), (0.03, 0.125, -0.085)]
    right = [(-x, y, z) for x, y, z in half]
    lip = [(-0.03, 0.06, -0.1), (0.0, 0.05, -0.105), (0.03, 0.06, -0.1)]
    return np.array([*half, *right[::-1], *lip]) + rng.normal(0, 0.003, (9, 3))


def _hair_colour(picture: NDArray[np.uint8], centre_px: Floats, crown_px: Floats) -> Floats:
    """What the picture shows a little below the crown."""
    height, width = picture.shape[:2]
    x, y = np.round(crown_px + 0.18 * (centre_px - crown_px)).astype(int)
    return np.asarray(picture[min(max(y, 0), height - 1), min(max(x, 0), width - 1)], float)


def _painted(
    picture: NDArray[np.uint8], places: Floats, colour: Floats, cover: float, rng: np.random.Generator, rough: float = 0.25
) -> NDArray[np.uint8]:
    """A polygon filled with strands of a colour that differ by so much."""
    mask = np.zeros(picture.shape[:2], np.uint8)
    cv2.fillPoly(mask, [np.round(places * 2**SHIFT).astype(np.int32)], 255, cv2.LINE_AA, SHIFT)
    soft = cv2.GaussianBlur(mask, (0, 0), rng.uniform(0.4, 1.2))[..., None] * (cover / 255)
    strands = cv2.resize(rng.normal(1, rough, (6, 24)), picture.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    paint = (colour * rng.uniform(0.8, 1.2)) * strands[..., None]
    return np.asarray(np.clip(picture * (1 - soft) + paint * soft, 0, 255), np.uint8)
