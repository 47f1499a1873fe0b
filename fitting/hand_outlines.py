"""Held hands cut out as badly as a tracker does, and as the gesture stage then sees them."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from deixis_gesture.fingertips import find_fingers
from deixis_gesture.hand import CHEST, Face, hand_of
from deixis_gesture.held_hand import HeldHand, held_hand
from deixis_gesture.person import HEAD_ABOVE_FACE
from deixis_schemas.messages import Side
from hand_files import KnownHand
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]
Place = NDArray[np.floating[Any]]

FACE_MISSED, WIDTH_MISSED = 0.1, 0.1
"""How far off the face's place is measured, face widths, and its width, a share."""
FOREARM, BITTEN, FELLOW_SEEN, RIGHT_SIDE = 0.25, 0.12, 0.7, 0.9
"""Shares of hands with some of the forearm, of those from which something is missing, of other hands that are tracked, and of
hands whose side is known."""
CLOSED = (0.06, 0.3)
"""Width of gaps that are closed, face widths: between the fingers of an open hand they are as wide as a finger, .12."""
MARGIN_PX = 12


def seen_hand(known: KnownHand, rng: np.random.Generator) -> HeldHand | None:
    """The hand as the stage has it; none where nothing is left of it."""
    face = _measured_face(known, rng)
    mask = _cut_out(known, face, rng)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not outlines:
        return None
    outline = max(outlines, key=len)[:, 0, :] - _margin_px(face)
    hand = hand_of(face.normalised(outline))
    if hand is None:
        return None
    own: Side = "left" if known.side == "left" else "right"
    other: Side = "right" if own == "left" else "left"
    return held_hand(hand, find_fingers(hand), own if rng.random() < RIGHT_SIDE else other, _fellow(known, face, rng))


def _measured_face(known: KnownHand, rng: np.random.Generator) -> Face:
    width = known.face_width_px * float(np.exp(rng.normal(0, WIDTH_MISSED)))
    x, y = known.head_px + rng.normal(0, FACE_MISSED, 2) * width
    return Face(float(x), float(y) + HEAD_ABOVE_FACE * known.face_width_px, width)


def _margin_px(face: Face) -> int:
    return MARGIN_PX + int(1.5 * face.width_px)


def _cut_out(known: KnownHand, face: Face, rng: np.random.Generator) -> Pixels:
    mask = coarse(np.pad(known.hand.astype(np.uint8), _margin_px(face)), face.width_px, rng)
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return mask
    if rng.random() < FOREARM:
        _add_forearm(mask, np.array([columns.mean(), rows.mean()]), face, rng)
    if rng.random() < BITTEN:
        row = int(rng.integers(len(rows)))
        radius = max(1, int(face.width_px * rng.uniform(0.1, 0.3)))
        cv2.circle(mask, (int(columns[row]), int(rows[row])), radius, (0,), -1)
    return mask


def coarse(mask: Pixels, face_px: float, rng: np.random.Generator) -> Pixels:
    """Edges a pixel off, thin fingers lost, gaps between fingers closed (trackers mostly do that); or as it is."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    square = np.ones((3, 3), np.uint8)
    kind = rng.random()
    if kind < 0.1:
        return np.asarray(cv2.dilate(mask, cross), np.uint8)
    if kind < 0.2:
        return np.asarray(cv2.erode(mask, cross), np.uint8)
    if kind < 0.35:
        return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, square), np.uint8)
    if kind < 0.8:
        gap = round(face_px * rng.uniform(*CLOSED)) | 1
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (gap, gap))
        return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, disc), np.uint8)
    return mask


def _add_forearm(mask: Pixels, middle: Place, face: Face, rng: np.random.Generator) -> None:
    """A bare forearm that was not cut off, roughly toward the chest."""
    chest = np.array(face.pixels(CHEST)) + _margin_px(face)
    way = (chest - middle) / max(1e-6, float(np.hypot(*(chest - middle))))
    cos, sin = np.cos(turn := rng.normal(0, 0.5)), np.sin(turn)
    end = middle + np.array([[cos, -sin], [sin, cos]]) @ way * face.width_px * rng.uniform(0.4, 1.3)
    broad = max(1, int(face.width_px * rng.uniform(0.25, 0.4)))
    cv2.line(mask, [int(v) for v in middle], [int(v) for v in end], (1,), broad)


def _fellow(known: KnownHand, face: Face, rng: np.random.Generator) -> tuple[float, float] | None:
    rows, columns = np.nonzero(known.other)
    if len(rows) < MARGIN_PX or rng.random() > FELLOW_SEEN:
        return None
    x, y = face.normalised([(columns.mean(), rows.mean())])[0]
    return float(x), float(y)
