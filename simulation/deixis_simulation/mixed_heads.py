"""More faces than there are avatars: heads mixed of several, with hair where no avatar has it.

All avatars are one mesh whose vertices lie at the same places of their pictures, so a texel shows the same point of any face.
A few thousand portraits of eight faces had taught a network those eight: strangers were read 5 to 20 degrees aside throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from .avatars import HEAD, Avatar, AvatarError, Mask, load_avatar
from .body import head_share
from .geometry import Floats
from .head_atlas import ATLAS_PX, HEIGHTS_M, SKULL_M, Atlas, atlas_of, by_height, noise, softened, square_coordinates
from .head_paint import beard, hairline, mixed_face, shaved, with_hair

PAINTED, BALD, BEARD, WIG = 0.55, 0.2, 0.2, 0.8
"""Shares of heads with painted hair and with none (others have an avatar's); of beards; of wigs kept where there is one."""
THICKEST_M = 0.035
TUCKED, SWEPT = 0.4, 0.3
"""Shares of sides on which long hair is put behind the ear, and on which it falls into the face."""


def reduced(avatar: Avatar) -> Avatar:
    """The avatar with its pictures as mixed ones have them."""
    atlas = atlas_of(avatar.name)
    return _painted(avatar, atlas, atlas.colours, atlas.skin)


def mixed_head(base: str, others: Sequence[str], rng: np.random.Generator) -> Avatar:
    """The avatar `base` with a head mixed of its own and those of others. Raises AvatarError, also where there is no other."""
    avatar, others = load_avatar(base), [name for name in others if name != base]
    if not others:
        raise AvatarError(f"'{base}' alone: a head is mixed of two avatars at least")
    face, shape = (load_avatar(str(rng.choice(others))) for _ in range(2))
    vertices = _mixed_shape(avatar, shape, rng)
    atlas = atlas_of(base)
    colours, skin = mixed_face(atlas, atlas_of(face.name), rng)
    kind = rng.random()
    if kind < PAINTED + BALD:
        colours, skin = shaved(atlas, colours, skin)
    if kind < PAINTED:
        hair = hairline(atlas, rng)
        colours, skin = with_hair(colours, skin, hair, rng)
        vertices = _thickened(avatar, vertices, hair, rng)
    if rng.random() < BEARD:
        colours, skin = with_hair(colours, skin, beard(atlas, rng), rng)
    if rng.random() > WIG or PAINTED <= kind < PAINTED + BALD:
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
    share = by_height(own, rng.uniform(-0.35, 1.25) + rng.normal(0, 0.25, len(HEIGHTS_M)))
    vertices = avatar.vertices.astype(float)
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
    near = cKDTree(square_coordinates(second)[there]).query(square_coordinates(first)[first.head_vertices])[1]
    found: Floats = (second.vertices[there[near]] - second.eyes).astype(float)
    return found


def _thickened(avatar: Avatar, vertices: Floats, hair: Floats, rng: np.random.Generator) -> Floats:
    """With the scalp moved outward where there is hair, more here than there."""
    rows = avatar.head_vertices
    at = np.clip(square_coordinates(avatar)[rows] * ATLAS_PX, 0, ATLAS_PX - 1).astype(int)
    own = avatar.vertices[rows] - avatar.eyes - SKULL_M
    soft = softened(hair, 6)[at[:, 1], at[:, 0]]
    out = own / np.linalg.norm(own, axis=1, keepdims=True)
    thick = rng.uniform(0, THICKEST_M) * np.clip(1 + 0.5 * noise(own, 0.06, rng), 0.1, 2)
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


def _painted(avatar: Avatar, atlas: Atlas, colours: Floats, skin: Floats) -> Avatar:
    below = atlas.rest
    pictures = np.clip(colours, 0, 255).astype(np.uint8), np.clip(255 * skin, 0, 255).astype(np.uint8)
    whole = [np.concatenate([upper, lower]) for upper, lower in zip(pictures, below, strict=True)]
    return replace(avatar, colours=whole[0], skin_mask=whole[1])
