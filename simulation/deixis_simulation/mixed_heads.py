"""More faces than there are avatars: heads mixed of several, with hair where no avatar has it.

All avatars are one mesh whose vertices lie at the same places of their pictures, so a texel shows the same point of any face.
A few thousand portraits of eight faces had taught a network those eight: strangers were read 5 to 20 degrees aside throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .avatars import HEAD, Avatar, Mask, Picture, load_avatar
from .body import head_share
from .geometry import Floats

ATLAS_PX = 768
"""Side of the picture of body and head, after reduction: portraits show no more."""
WIGGED = "AIAN_F_1_Casual"
"""The avatar whose hair is a wig, on a scalp of skin."""
HEIGHTS_M = np.array([-0.14, -0.07, -0.035, 0.0, 0.05, 0.12])
"""Chin, mouth, nose, eyes, forehead, crown, from between the eyes: what is mixed of two is mixed differently at each."""
SKULL_M = np.array([0.0, 0.01, -0.085])
"""Middle of the skull, from between the eyes."""
AROUND_DEG = np.array([0.0, 35.0, 60.0, 80.0, 110.0, 180.0])
HAIRLINE_DEG = np.array([42.0, 38.0, 18.0, -12.0, -38.0, -48.0])
"""Usual hairline: its elevation from the middle of the skull by how far around the head, forehead to nape."""
HAIRLINE_SPREAD_DEG = np.array([8.0, 8.0, 10.0, 14.0, 10.0, 8.0])
LONG_DEG = np.array([-2.0, -4.0, -30.0, -48.0, -55.0, -55.0])
"""How hair that hangs down changes it at most."""
PAINTED, BALD_SHARE, ONE_SIDED, BEARD, WIG = 0.55, 0.2, 0.45, 0.2, 0.8
"""Shares of heads with painted hair and with none (others have an avatar's); of painted ones that differ by side; of beards;
of wigs kept where an avatar has one."""
THICKEST_M = 0.035
TUCKED, SWEPT = 0.4, 0.3
"""Shares of sides on which long hair is put behind the ear, and on which it falls into the face."""


@dataclass(frozen=True)
class _Atlas:
    """An avatar's pictures, reduced.

    places: (h, w, 3), the point of the head that a texel shows, from between the eyes, metres; head: (h, w), where it shows
    one. rest: rows below the square, of a wig.
    """

    colours: Floats
    skin: Floats
    places: Floats
    head: Mask
    rest: tuple[Picture, Picture]


def reduced(avatar: Avatar) -> Avatar:
    """The avatar with its pictures as mixed ones have them."""
    atlas = _atlas(avatar.name)
    return _painted(avatar, atlas, atlas.colours, atlas.skin)


def mixed_head(base: str, others: Sequence[str], rng: np.random.Generator) -> Avatar:
    """The avatar `base` with a head mixed of its own and those of others. Raises AvatarError."""
    avatar = load_avatar(base)
    face, shape = (load_avatar(str(rng.choice([name for name in others if name != base]))) for _ in range(2))
    vertices = _mixed_shape(avatar, shape, rng)
    atlas = _atlas(base)
    colours, skin = _mixed_face(atlas, _atlas(face.name), rng)
    hair = np.zeros(atlas.head.shape)
    kind = rng.random()
    if kind < PAINTED + BALD_SHARE:
        colours, skin = _shaved(atlas, colours, skin)
    if kind < PAINTED:
        hair = _hairline(atlas, rng)
        colours, skin = _with_hair(colours, skin, hair, rng)
        vertices = _thickened(avatar, vertices, hair, rng)
    if rng.random() < BEARD:
        colours, skin = _with_hair(colours, skin, _beard(atlas, rng), rng)
    if rng.random() > WIG or PAINTED <= kind < PAINTED + BALD_SHARE:
        vertices = _without_wig(avatar, vertices)
    else:
        vertices = _combed(avatar, vertices, rng)
    return _painted(replace(avatar, vertices=vertices.astype(np.float32)), atlas, colours, skin)


# --- shape ----------------------------------------------------------------------------------------------------------------


def _mixed_shape(avatar: Avatar, other: Avatar, rng: np.random.Generator) -> Floats:
    """Vertices (n, 3) with a head between the two avatars', or beyond; eyes stay, the neck follows less and less."""
    rows = avatar.head_vertices
    own = (avatar.vertices[rows] - avatar.eyes).astype(float)
    shift = _counterpart(avatar.name, other.name) * _eyes_apart(avatar) / _eyes_apart(other) - own
    share = _by_height(own, rng.uniform(-0.35, 1.25) + rng.normal(0, 0.25, len(HEIGHTS_M)))
    vertices = avatar.vertices.astype(float)
    moved = np.zeros(len(vertices), bool)
    moved[rows] = True
    offset = shift * share[:, None]
    vertices[rows] += offset * head_share(avatar)[rows, None]
    wig = np.flatnonzero(_is_wig(avatar))
    if len(wig):
        near = cKDTree(avatar.vertices[rows]).query(avatar.vertices[wig])[1]
        vertices[wig] += offset[near] * head_share(avatar)[wig, None]
    return vertices


@lru_cache(maxsize=64)
def _counterpart(name: str, other: str) -> Floats:
    """For each vertex of the first one's head, where the other has it (k, 3), from between its eyes."""
    first, second = load_avatar(name), load_avatar(other)
    there = second.head_vertices
    near = cKDTree(_square_coordinates(second)[there]).query(_square_coordinates(first)[first.head_vertices])[1]
    found: Floats = (second.vertices[there[near]] - second.eyes).astype(float)
    return found


def _thickened(avatar: Avatar, vertices: Floats, hair: Floats, rng: np.random.Generator) -> Floats:
    """With the scalp moved outward where there is hair, more here than there."""
    rows = avatar.head_vertices
    at = np.clip(_square_coordinates(avatar)[rows] * ATLAS_PX, 0, ATLAS_PX - 1).astype(int)
    own = avatar.vertices[rows] - avatar.eyes - SKULL_M
    soft = _soft(hair, 6)[at[:, 1], at[:, 0]]
    out = own / np.linalg.norm(own, axis=1, keepdims=True)
    thick = rng.uniform(0, THICKEST_M) * np.clip(1 + 0.5 * _noise(own, 0.06, rng), 0.1, 2)
    moved = vertices.copy()
    moved[rows] += out * (soft * thick * head_share(avatar)[rows])[:, None]
    return moved


def _combed(avatar: Avatar, vertices: Floats, rng: np.random.Generator) -> Floats:
    """With the wig cut to any length, and each side combed by itself: behind the ear, or into the face.

    One ear free and one covered was read as a turn of 10 to 25 degrees, of drivers and of people who sign.
    """
    wig = np.flatnonzero(_is_wig(avatar))
    own = vertices[wig] - avatar.eyes - SKULL_M
    around = np.arctan2(own[:, 0], own[:, 2]) + np.radians(rng.normal(0, 8))
    wide, y = np.hypot(own[:, 0], own[:, 2]) * rng.uniform(0.94, 1.15), own[:, 1]
    hanging = np.clip((0.05 - y) / 0.06, 0, 1)
    for side in (-1.0, 1.0):
        here = hanging * (np.sign(around) == side)
        kind = rng.random()
        back_deg = rng.uniform(20, 65) if kind < TUCKED else -rng.uniform(0, 28) if kind < TUCKED + SWEPT else rng.normal(0, 6)
        # What hangs at the back has no farther to go.
        around = around + side * np.radians(back_deg) * here * (1 - np.abs(around) / np.pi)
    longer = rng.uniform(0.2, 1.3)
    low = np.where(y < -0.07, -0.07 + (y + 0.07) * longer, y)
    moved = vertices.copy()
    moved[wig] = avatar.eyes + SKULL_M + np.stack([wide * np.sin(around), low, wide * np.cos(around)], axis=1)
    return moved


def _without_wig(avatar: Avatar, vertices: Floats) -> Floats:
    """With the wig put away, into the skull."""
    moved = vertices.copy()
    moved[_is_wig(avatar)] = avatar.eyes + SKULL_M
    return moved


def _is_wig(avatar: Avatar) -> Mask:
    wig: Mask = (avatar.part == HEAD) & ~avatar.is_body & ~avatar.is_eye
    return wig


def _eyes_apart(avatar: Avatar) -> float:
    return float(np.linalg.norm(avatar.joint("RightEye") - avatar.joint("LeftEye")))


# --- colours --------------------------------------------------------------------------------------------------------------


def _mixed_face(own: _Atlas, other: _Atlas, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Head of two, mixed differently from chin to crown, lighter or darker."""
    share = np.where(own.head, _by_height(own.places, rng.uniform(0, 1) + rng.normal(0, 0.3, len(HEIGHTS_M))), 0.0)
    share = _soft(np.clip(share, 0, 1), 2)[..., None]
    colours = own.colours * (1 - share) + other.colours * share
    skin = own.skin * (1 - share[..., 0]) + other.skin * share[..., 0]
    tone = np.exp(rng.normal(-0.1, 0.3) + rng.normal(0, 0.06, 3))
    paler = np.where((own.head * skin)[..., None] > 0.3, tone, 1.0)
    return np.clip(colours * paler, 0, 255), skin


def _shaved(own: _Atlas, colours: Floats, skin: Floats) -> tuple[Floats, Floats]:
    """With skin instead of hair."""
    bald = _atlas(WIGGED)
    around, up = _bearing(own.places)
    face = own.head & (np.abs(around) < 50) & (up < 25) & (up > -40) & (skin > 0.5)
    ratio = colours[face].mean(axis=0) / np.maximum(bald.colours[face].mean(axis=0), 1)
    # The face keeps its own colours; from the temples and the forehead on it passes into the bald one.
    inner = own.head & (np.abs(around) < 52) & (up < 24)
    keep = np.where(own.head, _soft(inner.astype(float), 7), 1.0)[..., None]
    return colours * keep + np.clip(bald.colours * ratio, 0, 255) * (1 - keep), skin * keep[..., 0] + 1 - keep[..., 0]


def _with_hair(colours: Floats, skin: Floats, cover: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """With strands of one colour where `cover` (h, w) says."""
    light = float(np.exp(rng.uniform(np.log(8), np.log(190))))
    colour = light * np.array([1.0, rng.uniform(0.6, 1.0), rng.uniform(0.3, 0.95)])
    size = (14, 220) if rng.random() < 0.5 else (220, 14)
    strands = cv2.resize(rng.normal(1, rng.uniform(0.03, 0.4), size), (ATLAS_PX, ATLAS_PX), interpolation=cv2.INTER_LINEAR)
    hair = np.clip(colour * strands[..., None], 0, 255)
    cover = cover[..., None]
    return colours * (1 - cover) + hair * cover, skin * (1 - cover[..., 0])


def _hairline(own: _Atlas, rng: np.random.Generator) -> Floats:
    """How far each texel (h, w) is covered by hair: all above a line around the head."""
    around, up = _bearing(own.places)
    long = LONG_DEG * (rng.uniform(0, 1) if rng.random() < 0.5 else 0.0)
    left = HAIRLINE_DEG + long + rng.normal(0, HAIRLINE_SPREAD_DEG)
    right = left + rng.normal(0, 4, len(left))
    if rng.random() < ONE_SIDED:
        right = right + rng.choice([-1, 1]) * rng.uniform(0.2, 1) * (LONG_DEG - [12, 8, 0, 0, 0, 0])
    sides = np.where(around > 0, np.interp(around, AROUND_DEG, left), np.interp(-around, AROUND_DEG, right))
    # A parting aside: the two sides meet softly.
    middle = np.clip(around / 15 + 0.5 + rng.normal(0, 0.7), 0, 1)
    front = np.interp(np.abs(around), AROUND_DEG, left) * middle + np.interp(np.abs(around), AROUND_DEG, right) * (1 - middle)
    line = np.where(np.abs(around) < 25, front, sides) + 4 * _texel_noise(own.places, rng)
    cover = np.clip((up - line) / rng.uniform(1, 8) + 0.5, 0, 1)
    if rng.random() < 0.15:  # a bald crown
        cover = cover * np.clip((rng.uniform(35, 65) - up) / 6, 0, 1)
    return _soft(np.where(own.head, cover, 0.0), 1)


def _beard(own: _Atlas, rng: np.random.Generator) -> Floats:
    """How far each texel (h, w) is covered by a beard: below a line from ear to lip, but for the mouth."""
    x, y, _ = np.moveaxis(own.places, -1, 0)
    line = -0.045 + rng.normal(0, 0.008) + np.abs(x) * rng.uniform(-0.2, 0.6) + 0.004 * _texel_noise(own.places, rng)
    mouth = (x / 0.028) ** 2 + ((y + 0.068) / 0.011) ** 2 < 1
    around = np.abs(_bearing(own.places)[0])
    cover = np.clip((line - y) / 0.012, 0, 1) * (around < 85) * ~mouth * np.clip((y + 0.19) / 0.03, 0, 1)
    return _soft(np.where(own.head, cover, 0.0), 1.5) * float(rng.uniform(0.2, 0.95))


def _painted(avatar: Avatar, atlas: _Atlas, colours: Floats, skin: Floats) -> Avatar:
    below = atlas.rest
    pictures = np.clip(colours, 0, 255).astype(np.uint8), np.clip(255 * skin, 0, 255).astype(np.uint8)
    whole = [np.concatenate([upper, lower]) for upper, lower in zip(pictures, below, strict=True)]
    return replace(avatar, colours=whole[0], skin_mask=whole[1])


# --- where a texel is -----------------------------------------------------------------------------------------------------


@lru_cache(maxsize=16)
def _atlas(name: str) -> _Atlas:
    avatar = load_avatar(name)
    tall = avatar.colours.shape[0] // avatar.colours.shape[1] * ATLAS_PX
    colours, skin = (
        cv2.resize(picture, (ATLAS_PX, tall), interpolation=cv2.INTER_AREA) for picture in (avatar.colours, avatar.skin_mask)
    )
    places, head = _texel_places(avatar)
    square = slice(0, ATLAS_PX)
    rest = colours[ATLAS_PX:].astype(np.uint8), skin[ATLAS_PX:].astype(np.uint8)
    return _Atlas(colours[square].astype(float), skin[square].astype(float) / 255, places, head, rest)


def _texel_places(avatar: Avatar) -> tuple[Floats, Mask]:
    """By triangle: they are smaller than what is painted."""
    places, head = np.zeros((ATLAS_PX, ATLAS_PX, 3), np.float32), np.zeros((ATLAS_PX, ATLAS_PX), np.uint8)
    corners = np.round(_square_coordinates(avatar) * ATLAS_PX - 0.5).astype(np.int32)
    is_head = (avatar.part == HEAD) & avatar.is_body
    own = avatar.vertices - avatar.eyes
    outer = np.linalg.norm(own - SKULL_M, axis=1) > 0.05  # teeth and tongue are head as well
    for triangle in avatar.triangles[(is_head & outer)[avatar.triangles].all(axis=1)]:
        cv2.fillConvexPoly(places, corners[triangle], own[triangle].mean(axis=0).tolist())
        cv2.fillConvexPoly(head, corners[triangle], 1)
    near = np.maximum(_soft(head.astype(float), 1.5), 1e-3)[..., None]
    return _soft(places.astype(float), 1.5) / near, head > 0


def _square_coordinates(avatar: Avatar) -> NDArray[np.float32]:
    """Texture coordinates (n, 2) within the square of body and head; a wig's lie below it."""
    tall = avatar.colours.shape[0] // avatar.colours.shape[1]
    return avatar.texture_coordinates * np.array([1, tall], np.float32)


def _bearing(places: Floats) -> tuple[Floats, Floats]:
    """Degrees around the skull (0: ahead, positive to the person's left) and up."""
    x, y, z = np.moveaxis(places - SKULL_M, -1, 0)
    return np.degrees(np.arctan2(x, z)), np.degrees(np.arctan2(y, np.hypot(x, z)))


def _by_height(places: Floats, values: Floats) -> Floats:
    return np.interp(places[..., 1], HEIGHTS_M, values)


def _soft(values: Floats, sigma_px: float) -> Floats:
    return np.asarray(cv2.GaussianBlur(values, (0, 0), sigma_px), float)


def _texel_noise(places: Floats, rng: np.random.Generator) -> Floats:
    """Smooth noise (h, w) for all texels, of which every fourth is enough."""
    coarse = _noise(places[::4, ::4] - SKULL_M, 0.03, rng)
    return np.asarray(cv2.resize(coarse, places.shape[1::-1], interpolation=cv2.INTER_LINEAR))


def _noise(from_skull: Floats, radius_m: float, rng: np.random.Generator, bumps: int = 16) -> Floats:
    """Smooth noise about 0, of about 1, on the head."""
    total = np.zeros(from_skull.shape[:-1])
    for centre in rng.normal(0, 0.09, (bumps, 3)):
        total += rng.normal(0, 1.5) * np.exp(-0.5 * np.sum((from_skull - centre) ** 2, axis=-1) / radius_m**2)
    return total
