"""Hands of any shape, seen from anywhere, as outlines: to fit and to check what tells a pointing hand from a fist or a palm.

Clips and `held_hands` show the nine shapes of fifteen gestures. A classifier that was to know a finger from a thumb or from two
fingers side by side has to have seen all of them: each finger here is stretched, bent or folded by itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import cv2
import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M
from numpy.typing import NDArray

from .arms import Arm, hanging_arm
from .avatars import BONE_PREFIX, load_avatar
from .body import Body, fit_body
from .geometry import Floats
from .hand_shapes import FIST, FLAT, INDEX, OPEN, REST, THUMB_UP, HandShape
from .rotations import about, across, unit
from .scene import ArmSide
from .skeleton import SIDES, Posture, solve
from .skinning import skin

Shape = Literal["index", "open", "fist", "thumb", "other"]
SHAPES: tuple[Shape, ...] = ("index", "open", "fist", "thumb", "other")
SHARES = (0.24, 0.14, 0.14, 0.1, 0.38)
"""How often each is drawn. `other`: one finger that is not the index, two, three, an L, hooks, claws and grips."""
VIEWS = 6
"""Of one hand in one shape: to bend the fingers costs as much as a few looks."""
PX_PER_FACE = 60
"""Pixels of a mask for the width of a face."""
LEAST_ACROSS = 0.45
"""Hands point at or away from the camera no more than so much of them is seen aside (cosine)."""
_BENT, _FOLDED, _HOOKED = (0.0, 0.16), (0.72, 1.05), (0.3, 0.62)
"""How far fingers are bent that are stretched, folded or hooked: shares of the way to a fist. With loosely folded ones
counted as an index finger alone, more of other hands were taken for one, and no more index fingers were found."""
_SLENDER = 0.05
"""How much longer or wider than the avatars' hands others are (standard deviation)."""
_FOREARM_M, _CUT_M = 0.16, 0.05
"""Of the forearm so much at most is drawn; so far about its cut its far side shows."""


@dataclass(frozen=True)
class LoneHand:
    """mask: (h, w) of 0 and 1, PX_PER_FACE pixels for a face's width. along: (2,) unit vector in the picture, x right and y
    down, from the forearm to the hand.
    """

    shape: Shape
    mask: NDArray[np.uint8]
    along: Floats


def lone_hands(seed: int, avatars: Sequence[str], count: int) -> Iterator[LoneHand]:
    """So many hands of these avatars; the same for the same arguments."""
    rng = np.random.default_rng(seed)
    made = 0
    while made < count:
        avatar, side = str(rng.choice(list(avatars))), SIDES[int(rng.integers(2))]
        shape = SHAPES[int(rng.choice(len(SHAPES), p=SHARES))]
        points, triangles, axes = _posed(avatar, side, drawn_shape(shape, rng), rng)
        for _ in range(min(VIEWS, count - made)):
            made += 1
            yield _seen(shape, points, triangles, axes, rng)


def drawn_shape(shape: Shape, rng: np.random.Generator) -> HandShape:
    """A hand of that shape, as one of many people makes it."""
    if shape == "other":
        return _other(rng)
    states = {"index": "sfff", "open": "ssss", "fist": "ffff", "thumb": "ffff"}[shape]
    if shape == "index":
        thumb = _between(INDEX.thumb, REST.thumb, rng.uniform(0, 0.8))
    elif shape == "open":
        thumb = _between(OPEN.thumb, FLAT.thumb, rng.uniform(-0.3, 1.6))
    elif shape == "fist":
        thumb = _between(FIST.thumb, REST.thumb, rng.uniform(0, 0.4))
    else:
        thumb = _between(THUMB_UP.thumb, OPEN.thumb, rng.uniform(-0.5, 1))
    spread = float(rng.uniform(-1, 14)) if shape == "open" else 0.0
    return HandShape(_bends(states, rng), thumb + rng.normal(0, 4, 3), spread)


def _other(rng: np.random.Generator) -> HandShape:
    """Any hand that is none of those with a name."""
    while True:
        states = "".join(rng.choice(list("sfh"), 4, p=(0.42, 0.38, 0.2)))
        thumb_out = rng.random() < 0.4
        named = states in ("ssss", "ffff") or (states == "sfff" and not thumb_out)
        if not named:
            break
    thumb = (
        _between(THUMB_UP.thumb, OPEN.thumb, rng.uniform(-0.5, 1))
        if thumb_out
        else _between(FIST.thumb, REST.thumb, rng.random())
    )
    return HandShape(_bends(states, rng), thumb + rng.normal(0, 4, 3), float(rng.uniform(-1, 14)))


def _bends(states: str, rng: np.random.Generator) -> Floats:
    """Bends (4, 3) of fingers that are stretched (s), folded (f) or hooked (h)."""
    share = {"s": _BENT, "f": _FOLDED, "h": _HOOKED}
    together = rng.random()
    shares = [low + (high - low) * (0.7 * together + 0.3 * rng.random()) for low, high in (share[state] for state in states)]
    bends: Floats = np.array(shares)[:, None] * FIST.bend + rng.normal(0, 3, (4, 3))
    return bends


def _between(start: Floats, end: Floats, share: float) -> Floats:
    mixed: Floats = (1 - share) * start + share * end
    return mixed


# --- one hand -------------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=16)
def _body(avatar: str) -> Body:
    person = load_avatar(avatar)
    return fit_body(person, float(person.vertices[:, 1].max()))


def _posed(avatar: str, side: ArmSide, shape: HandShape, rng: np.random.Generator) -> tuple[Floats, NDArray[np.int32], Floats]:
    """Points (n, 3) of hand and forearm about the wrist, its triangles, and axes (3, 3), rows: along the forearm, where the
    palm looks, across.
    """
    body, prefix = _body(avatar), BONE_PREFIX[side]
    arms = {each: hanging_arm(body, each) for each in SIDES}
    own = arms[side]
    bent = (
        about((1.0, 0.0, 0.0), rng.normal(0, 18))
        @ about((0.0, 0.0, 1.0), rng.normal(0, 9))
        @ about((0, 1, 0), rng.normal(0, 15))
    )
    arms[side] = Arm(own.upper, own.fore, own.hand @ bent, shape)
    skeleton = solve(body, Posture(arms=arms))
    rows, triangles = _hand_and_forearm(avatar, side)
    wrist = skeleton.position(f"{prefix}Hand")
    points = skin(skeleton, {}).vertices[rows].astype(float) - wrist
    along = unit(wrist - skeleton.position(f"{prefix}ForeArm"))
    palm = across(skeleton.rotation(f"{prefix}Hand") @ np.array([0.0, -1.0, 0.0]), along)
    return points, triangles, np.stack([along, palm, np.cross(along, palm)])


@lru_cache(maxsize=32)
def _hand_and_forearm(avatar: str, side: ArmSide) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Vertices of them, and triangles that number these."""
    person, prefix = load_avatar(avatar), BONE_PREFIX[side]
    bones = [
        row
        for row, bone in enumerate(person.bones)
        if bone.startswith((f"{prefix}Hand", f"{prefix}Finger", f"{prefix}ForeArm"))
    ]
    rows = np.flatnonzero(np.asarray(person.weights[:, bones].sum(axis=1)).ravel() > 0.5)
    number = np.full(len(person.vertices), -1, np.int32)
    number[rows] = np.arange(len(rows))
    triangles = number[person.triangles]
    return rows, triangles[(triangles >= 0).all(axis=1)]


def _seen(shape: Shape, points: Floats, triangles: NDArray[np.int32], axes: Floats, rng: np.random.Generator) -> LoneHand:
    """From anywhere around the forearm, not along it; with none of the forearm, or with some."""
    across_view = float(rng.uniform(LEAST_ACROSS, 1))
    toward, rolled = math.copysign(math.sqrt(1 - across_view**2), rng.random() - 0.5), float(rng.uniform(0, 2 * math.pi))
    along = np.array([0.0, -across_view, toward])
    side = np.array([1.0, 0.0, 0.0])
    up = np.cross(along, side)
    palm = math.cos(rolled) * side + math.sin(rolled) * up
    rotation = np.stack([along, palm, np.cross(along, palm)], axis=1) @ axes
    forearm_m = float(rng.uniform(-0.01, 0.02) if rng.random() < 0.6 else rng.uniform(0.02, _FOREARM_M))
    height_m = (points @ axes[0])[triangles].min(axis=1) + forearm_m
    kept, at_cut = height_m > 0, height_m < _CUT_M
    flat = (points @ rotation.T)[:, :2] * np.exp(rng.normal(0, _SLENDER, 2))
    turned = float(rng.uniform(-math.pi, math.pi))
    cosine, sine = math.cos(turned), math.sin(turned)
    flat = flat @ np.array([[cosine, sine], [-sine, cosine]])
    direction = np.array([0.0, -1.0]) @ np.array([[cosine, sine], [-sine, cosine]])
    return LoneHand(shape, _drawn((flat / FACE_WIDTH_M * PX_PER_FACE)[triangles[kept]], at_cut[kept]), direction)


def _drawn(used: Floats, at_cut: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Triangles (n, 3, 2), pixels, filled. Of a closed body those that face away add nothing; at the cut it is open. A
    tracker's outlines have no holes.
    """
    one, other = used[:, 1] - used[:, 0], used[:, 2] - used[:, 0]
    used = used[at_cut | (one[:, 0] * other[:, 1] > one[:, 1] * other[:, 0])]
    low = used.min(axis=(0, 1)) - 2
    corners = np.round((used - low) * 16).astype(np.int32)
    width, height = (int(v) for v in np.ceil(used.max(axis=(0, 1)) - low) + 3)
    mask = np.zeros((height, width), np.uint8)
    for corner in corners:
        cv2.fillConvexPoly(mask, corner, (1,), cv2.LINE_8, 4)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(cv2.drawContours(mask, outlines, -1, (1,), cv2.FILLED), np.uint8)
