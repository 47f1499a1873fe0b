"""The pictures of a head: which texel shows which point of it.

All avatars have the same layout, so a texel is the same point of any face.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from .avatars import HEAD, Avatar, Mask, Picture, load_avatar
from .geometry import Floats

ATLAS_PX = 768
"""Side of the picture of body and head, after reduction: portraits show no more."""
HEIGHTS_M = np.array([-0.14, -0.07, -0.035, 0.0, 0.05, 0.12])
"""Chin, mouth, nose, eyes, forehead, crown, from between the eyes: what is mixed of two is mixed differently at each."""
SKULL_M = np.array([0.0, 0.01, -0.085])
"""Middle of the skull, from between the eyes."""


@dataclass(frozen=True)
class Atlas:
    """An avatar's pictures, reduced.

    places: (h, w, 3), the point of the head that a texel shows, from between the eyes, metres; head: (h, w), where it shows
    one. rest: rows below the square, of a wig.
    """

    colours: Floats
    skin: Floats
    places: Floats
    head: Mask
    rest: tuple[Picture, Picture]


@lru_cache(maxsize=16)
def atlas_of(name: str) -> Atlas:
    """That of an avatar; made once. Raises AvatarError."""
    avatar = load_avatar(name)
    tall = avatar.colours.shape[0] // avatar.colours.shape[1] * ATLAS_PX
    colours, skin = (
        cv2.resize(picture, (ATLAS_PX, tall), interpolation=cv2.INTER_AREA) for picture in (avatar.colours, avatar.skin_mask)
    )
    places, head = _texel_places(avatar)
    square = slice(0, ATLAS_PX)
    rest = colours[ATLAS_PX:].astype(np.uint8), skin[ATLAS_PX:].astype(np.uint8)
    return Atlas(colours[square].astype(float), skin[square].astype(float) / 255, places, head, rest)


def _texel_places(avatar: Avatar) -> tuple[Floats, Mask]:
    """By triangle: they are smaller than what is painted."""
    places, head = np.zeros((ATLAS_PX, ATLAS_PX, 3), np.float32), np.zeros((ATLAS_PX, ATLAS_PX), np.uint8)
    corners = np.round(square_coordinates(avatar) * ATLAS_PX - 0.5).astype(np.int32)
    is_head = (avatar.part == HEAD) & avatar.is_body
    own = avatar.vertices - avatar.eyes
    outer = np.linalg.norm(own - SKULL_M, axis=1) > 0.05  # teeth and tongue are head as well
    for triangle in avatar.triangles[(is_head & outer)[avatar.triangles].all(axis=1)]:
        cv2.fillConvexPoly(places, corners[triangle], own[triangle].mean(axis=0).tolist())
        cv2.fillConvexPoly(head, corners[triangle], 1)
    near = np.maximum(softened(head.astype(float), 1.5), 1e-3)[..., None]
    return softened(places.astype(float), 1.5) / near, head > 0


def square_coordinates(avatar: Avatar) -> NDArray[np.float32]:
    """Texture coordinates (n, 2) within the square of body and head; a wig's lie below it."""
    tall = avatar.colours.shape[0] // avatar.colours.shape[1]
    return avatar.texture_coordinates * np.array([1, tall], np.float32)


def bearing_of(places: Floats) -> tuple[Floats, Floats]:
    """Degrees around the skull (0: ahead, positive to the person's left) and up."""
    x, y, z = np.moveaxis(places - SKULL_M, -1, 0)
    return np.degrees(np.arctan2(x, z)), np.degrees(np.arctan2(y, np.hypot(x, z)))


def by_height(places: Floats, values: Floats) -> Floats:
    """What is given for HEIGHTS_M, at these places (..., 3)."""
    return np.interp(places[..., 1], HEIGHTS_M, values)


def softened(values: Floats, sigma_px: float) -> Floats:
    """A field (h, w) or (h, w, 3) blurred."""
    return np.asarray(cv2.GaussianBlur(values, (0, 0), sigma_px), float)


def texel_noise(places: Floats, rng: np.random.Generator) -> Floats:
    """Smooth noise (h, w) for all texels, of which every fourth is enough."""
    coarse = noise(places[::4, ::4] - SKULL_M, 0.03, rng)
    return np.asarray(cv2.resize(coarse, places.shape[1::-1], interpolation=cv2.INTER_LINEAR))


def noise(from_skull: Floats, radius_m: float, rng: np.random.Generator, bumps: int = 16) -> Floats:
    """Smooth noise about 0, of about 1, on the head."""
    total = np.zeros(from_skull.shape[:-1])
    for centre in rng.normal(0, 0.09, (bumps, 3)):
        total += rng.normal(0, 1.5) * np.exp(-0.5 * np.sum((from_skull - centre) ** 2, axis=-1) / radius_m**2)
    return total
