"""Fingers by the room behind them: what colour misses of a hand, and what of the room it took for the hand.

Skin is found at half the resolution, where a finger two pixels wide has taken on the colour of the wall behind it, and videos
halve the resolution of colours once more: outlines ended at the knuckles. But the room behind the hand is remembered. A pixel
that is a mix of the hand's colour beside it and of the room's behind it, more of the hand, is part of the hand. And where the
picture is the room, though a wall of bricks or wood passes for skin, is none of it: so spread fingers come apart.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.frame import COARSE, Image, Mask
from deixis_tracker.hands import Hand

Colours = NDArray[np.floating[Any]]  # (H, W, 3)

REACH = 0.55  # head widths beyond the outline: an index finger
LEAST_SHARE = 0.4  # of the hand in a mix
DARKEST, BRIGHTEST = 0.45, 1.5  # of the hand's light
LEAST_CONTRAST = 14.0  # grey levels (root of the sum over the channels) between what is seen and the room
GAP = np.ones((3, 3), np.uint8)  # an edge of the room behind a finger is bridged
NOISE = 14.0  # grey levels that no mix explains
CLEARLY = 40.0  # grey levels between hand and room: then what equals the room is no hand
MOST_TAKEN = 0.4  # of an outline; where more of it equals the room, the room is remembered wrongly


def with_fingers(hand: Hand, picture: Image, room: Image, covered: Mask, head_width_px: float) -> Hand:
    """The hand with what of it lies beyond its outline, and without what of the room lies within, on the side of its tip.

    picture: (H, W, 3) at working resolution. room: (h, w, 3) at the coarse one, as it would look now. covered: (h, w), not 0
    where the room is not known or something else of the person is.
    """
    reach = max(2, round(REACH * head_width_px))
    height, width = hand.mask.shape
    x0, y0 = max(0, hand.x0 - reach), max(0, hand.y0 - reach)
    x1, y1 = min(picture.shape[1], hand.x0 + width + reach), min(picture.shape[0], hand.y0 + height + reach)
    mask = np.zeros((y1 - y0, x1 - x0), np.uint8)
    mask[hand.y0 - y0 : hand.y0 - y0 + height, hand.x0 - x0 : hand.x0 - x0 + width] = hand.mask
    behind, hidden = _of_window(room, x0, y0, x1, y1), _of_window(covered, x0, y0, x1, y1)
    of_hand, of_room = _told_apart(picture[y0:y1, x0:x1].astype(np.float32), behind.astype(np.float32), mask, reach)
    known = (hidden == 0) & _beyond(hand, x0, y0, mask.shape)
    left = np.asarray(mask & ~(of_room & known), np.uint8)
    if np.count_nonzero(left) < (1 - MOST_TAKEN) * hand.area:
        left = mask
    whole = _connected(left, np.asarray(of_hand & known, np.uint8))
    return hand._replace(mask=whole, x0=x0, y0=y0, area=int(np.count_nonzero(whole)))


def _told_apart(seen: Colours, room: Colours, mask: Mask, reach: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where the picture is a mix of the hand's colour nearby, lit more or less, and of the room, more of the hand; and where
    it is the room alone, of which the hand's colour is clearly another.
    """
    side = (2 * reach + 1, 2 * reach + 1)
    near = cv2.blur(mask.astype(np.float32), side, borderType=cv2.BORDER_CONSTANT)
    hand = cv2.blur(seen * mask[..., None], side, borderType=cv2.BORDER_CONSTANT) / np.maximum(near, 1e-6)[..., None]
    # Least squares: seen = lit * hand + bare * room, both of three channels.
    hh, rr, hr = _products(hand, hand), _products(room, room), _products(hand, room)
    hs, rs = _products(hand, seen), _products(room, seen)
    free = np.maximum(hh * rr - hr**2, 1.0)
    lit, bare = (hs * rr - rs * hr) / free, (rs * hh - hs * hr) / free
    rest = seen - lit[..., None] * hand - bare[..., None] * room
    share = 1 - bare
    light = lit / np.maximum(share, 0.1)
    explained = (near > 1e-6) & (_products(rest, rest) < NOISE**2)
    changed = _products(seen - room, seen - room) > LEAST_CONTRAST**2
    of_hand = explained & changed & (share > LEAST_SHARE) & (light > DARKEST) & (light < BRIGHTEST)
    return of_hand, ~changed & (_products(hand - room, hand - room) > CLEARLY**2)


def _products(one: Colours, other: Colours) -> Colours:
    return np.asarray(np.einsum("ijc,ijc->ij", one, other))


def _beyond(hand: Hand, x0: int, y0: int, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """The half of a window at (x0, y0) on the tip's side of the hand's middle: on the other is the forearm that was cut off."""
    (x, y), (tip_x, tip_y) = hand.centroid, hand.tip
    columns, rows = np.arange(shape[1]) + x0 - x, np.arange(shape[0]) + y0 - y
    return np.asarray(columns[None] * (tip_x - x) + rows[:, None] * (tip_y - y) > 0, np.bool_)


def _connected(mask: Mask, more: Mask) -> Mask:
    """The mask, with those parts of `more` that hang together with it, or nearly so: with what bridges the gap."""
    both = np.asarray(cv2.bitwise_or(mask, more), np.uint8)
    whole = _reached(mask, both)
    closed = cv2.bitwise_or(cv2.morphologyEx(both, cv2.MORPH_CLOSE, GAP), both)
    near = _reached(mask, np.asarray(closed, np.uint8))
    # Gaps are bridged where there is something beyond them, not between fingers that are spread.
    beyond = near & both & (1 - whole)
    if not beyond.any():
        return whole
    bridge = near & (1 - both) & np.asarray(cv2.dilate(beyond, GAP), np.uint8)
    return np.asarray(whole | beyond | bridge, np.uint8)


def _reached(seed: Mask, ground: Mask) -> Mask:
    """The parts of `ground` that hold some of `seed`."""
    _, labels = cv2.connectedComponents(ground, connectivity=4, ltype=cv2.CV_16U)
    kept = np.zeros(int(labels.max()) + 1, np.uint8)
    kept[labels[seed != 0]] = 1
    kept[0] = 0
    return np.asarray(kept[labels], np.uint8)


def _of_window(coarse: NDArray[np.uint8], x0: int, y0: int, x1: int, y1: int) -> NDArray[np.uint8]:
    """Part of a coarse picture, at working resolution."""
    part = coarse[int(y0 * COARSE) : int(y1 * COARSE) + 2, int(x0 * COARSE) : int(x1 * COARSE) + 2]
    flags = cv2.INTER_LINEAR if coarse.ndim == 3 else cv2.INTER_NEAREST
    large = cv2.resize(part, None, fx=1 / COARSE, fy=1 / COARSE, interpolation=flags)
    left, top = x0 - int(x0 * COARSE) * 2, y0 - int(y0 * COARSE) * 2
    large = large[top : top + y1 - y0, left : left + x1 - x0]
    down, across = y1 - y0 - large.shape[0], x1 - x0 - large.shape[1]
    return np.asarray(cv2.copyMakeBorder(large, 0, down, 0, across, cv2.BORDER_REPLICATE), np.uint8)
