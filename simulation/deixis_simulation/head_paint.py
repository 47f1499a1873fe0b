"""Faces and hair as painted on a head's pictures: of two faces, bald, with a hairline or a beard that no avatar has."""

from __future__ import annotations

import cv2
import numpy as np

from .avatars import WIGGED
from .geometry import Floats
from .head_atlas import ATLAS_PX, HEIGHTS_M, Atlas, atlas_of, bearing_of, by_height, softened, texel_noise

AROUND_DEG = np.array([0.0, 35.0, 60.0, 80.0, 110.0, 180.0])
HAIRLINE_DEG = np.array([42.0, 38.0, 18.0, -12.0, -38.0, -48.0])
"""Usual hairline: its elevation from the middle of the skull by how far around the head, forehead to nape."""
HAIRLINE_SPREAD_DEG = np.array([8.0, 8.0, 10.0, 14.0, 10.0, 8.0])
LONG_DEG = np.array([-2.0, -4.0, -30.0, -48.0, -55.0, -55.0])
"""How hair that hangs down changes it at most."""
ONE_SIDED, BALD_CROWN = 0.45, 0.15
"""Shares of hairlines that differ by side, and of those with a bald crown."""


def mixed_face(own: Atlas, other: Atlas, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Head of two, mixed differently from chin to crown, lighter or darker."""
    share = np.where(own.head, by_height(own.places, rng.uniform(0, 1) + rng.normal(0, 0.3, len(HEIGHTS_M))), 0.0)
    share = softened(np.clip(share, 0, 1), 2)[..., None]
    colours = own.colours * (1 - share) + other.colours * share
    skin = own.skin * (1 - share[..., 0]) + other.skin * share[..., 0]
    tone = np.exp(rng.normal(-0.1, 0.3) + rng.normal(0, 0.06, 3))
    paler = np.where((own.head * skin)[..., None] > 0.3, tone, 1.0)
    return np.clip(colours * paler, 0, 255), skin


def shaved(own: Atlas, colours: Floats, skin: Floats) -> tuple[Floats, Floats]:
    """With skin instead of hair."""
    bald = atlas_of(WIGGED)
    around, up = bearing_of(own.places)
    face = own.head & (np.abs(around) < 50) & (up < 25) & (up > -40) & (skin > 0.5)
    ratio = colours[face].mean(axis=0) / np.maximum(bald.colours[face].mean(axis=0), 1)
    # The face keeps its own colours; from the temples and the forehead on it passes into the bald one.
    inner = own.head & (np.abs(around) < 52) & (up < 24)
    keep = np.where(own.head, softened(inner.astype(float), 7), 1.0)[..., None]
    return colours * keep + np.clip(bald.colours * ratio, 0, 255) * (1 - keep), skin * keep[..., 0] + 1 - keep[..., 0]


def with_hair(colours: Floats, skin: Floats, cover: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """With strands of one colour where `cover` (h, w) says."""
    light = float(np.exp(rng.uniform(np.log(8), np.log(190))))
    colour = light * np.array([1.0, rng.uniform(0.6, 1.0), rng.uniform(0.3, 0.95)])
    size = (14, 220) if rng.random() < 0.5 else (220, 14)
    strands = cv2.resize(rng.normal(1, rng.uniform(0.03, 0.4), size), (ATLAS_PX, ATLAS_PX), interpolation=cv2.INTER_LINEAR)
    hair = np.clip(colour * strands[..., None], 0, 255)
    cover = cover[..., None]
    return colours * (1 - cover) + hair * cover, skin * (1 - cover[..., 0])


def hairline(own: Atlas, rng: np.random.Generator) -> Floats:
    """How far each texel (h, w) is covered by hair: all above a line around the head."""
    around, up = bearing_of(own.places)
    long = LONG_DEG * (rng.uniform(0, 1) if rng.random() < 0.5 else 0.0)
    left = HAIRLINE_DEG + long + rng.normal(0, HAIRLINE_SPREAD_DEG)
    right = left + rng.normal(0, 4, len(left))
    if rng.random() < ONE_SIDED:
        right = right + rng.choice([-1, 1]) * rng.uniform(0.2, 1) * (LONG_DEG - [12, 8, 0, 0, 0, 0])
    sides = np.where(around > 0, np.interp(around, AROUND_DEG, left), np.interp(-around, AROUND_DEG, right))
    # A parting aside: the two sides meet softly.
    middle = np.clip(around / 15 + 0.5 + rng.normal(0, 0.7), 0, 1)
    front = np.interp(np.abs(around), AROUND_DEG, left) * middle + np.interp(np.abs(around), AROUND_DEG, right) * (1 - middle)
    line = np.where(np.abs(around) < 25, front, sides) + 4 * texel_noise(own.places, rng)
    cover = np.clip((up - line) / rng.uniform(1, 8) + 0.5, 0, 1)
    if rng.random() < BALD_CROWN:
        cover = cover * np.clip((rng.uniform(35, 65) - up) / 6, 0, 1)
    return softened(np.where(own.head, cover, 0.0), 1)


def beard(own: Atlas, rng: np.random.Generator) -> Floats:
    """How far each texel (h, w) is covered by a beard: below a line from ear to lip, but for the mouth."""
    x, y, _ = np.moveaxis(own.places, -1, 0)
    line = -0.045 + rng.normal(0, 0.008) + np.abs(x) * rng.uniform(-0.2, 0.6) + 0.004 * texel_noise(own.places, rng)
    mouth = (x / 0.028) ** 2 + ((y + 0.068) / 0.011) ** 2 < 1
    around = np.abs(bearing_of(own.places)[0])
    cover = np.clip((line - y) / 0.012, 0, 1) * (around < 85) * ~mouth * np.clip((y + 0.19) / 0.03, 0, 1)
    return softened(np.where(own.head, cover, 0.0), 1.5) * float(rng.uniform(0.2, 0.95))
