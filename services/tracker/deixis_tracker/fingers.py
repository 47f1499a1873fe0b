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

Colours = NDArray[np.floating[Any]]  # (..., 3)

REACH = 0.55  # head widths beyond the outline: an index finger
LEAST_SHARE = 0.4  # of the hand in a mix
DARKEST, BRIGHTEST = 0.45, 1.5  # of the hand's light
LEAST_CONTRAST = 14.0  # grey levels (root of the sum over the channels) between what is seen and the room
GAP = np.ones((5, 5), np.uint8)  # an edge of the room behind a finger is bridged
NOISE = 14.0  # grey levels that no mix explains
CLEARLY = 40.0  # grey levels between hand and room: then what equals the room is no hand
MOST_TAKEN = 0.4  # of an outline; where more of it equals the room, the room is remembered wrongly


def with_fingers(hand: Hand, picture: Image, room: Image, covered: Mask, head_width_px: float) -> Hand:
    """The hand with what of it lies beyond its outline, and without what of the room lies within, on the side of its tip.

    picture: (H, W, 3) at working resolution. room: (h, w, 3) at the coarse one, as it would look now. covered: (h, w), not 0
    where the room is not known or something else of the person is. Its centroid stays: what is added comes and goes.
    """
    reach = max(2, round(REACH * head_width_px))
    height, width = hand.mask.shape
    x0, y0 = max(0, hand.x0 - reach), max(0, hand.y0 - reach)
    x1, y1 = min(picture.shape[1], hand.x0 + width + reach), min(picture.shape[0], hand.y0 + height + reach)
    mask = np.zeros((y1 - y0, x1 - x0), np.uint8)
    mask[hand.y0 - y0 : hand.y0 - y0 + height, hand.x0 - x0 : hand.x0 - x0 + width] = hand.mask
    seen, behind = picture[y0:y1, x0:x1], _of_window(room, x0, y0, x1, y1)
    known = (_of_window(covered, x0, y0, x1, y1) == 0) & _beyond(hand, x0, y0, mask.shape)
    differs = _squares(np.asarray(cv2.subtract(seen, behind, dtype=cv2.CV_32F), np.float32)) > LEAST_CONTRAST**2
    colours = _Colours(seen, behind, mask, reach)
    doubtful = np.flatnonzero(known & differs & (mask == 0))
    more = np.zeros_like(mask)
    more.ravel()[doubtful[colours.are_of_hand(doubtful)]] = 1
    bare = np.flatnonzero(known & ~differs & (mask != 0))
    less = bare[colours.are_clearly_room(bare)]
    left = mask
    if len(less) <= MOST_TAKEN * hand.area:
        left = mask.copy()
        left.ravel()[less] = 0
    whole = _connected(left, more)
    return hand._replace(mask=whole, x0=x0, y0=y0, area=int(np.count_nonzero(whole)))


class _Colours:
    """The colours in a window: what is seen, the room behind it, and that of the hand nearby."""

    def __init__(self, seen: Image, room: Image, mask: Mask, reach: int) -> None:
        self._seen, self._room = seen.reshape(-1, 3), room.reshape(-1, 3)
        self._width = mask.shape[1]
        # The hand's colour nearby changes slowly: at half the resolution it costs a quarter.
        half = np.ascontiguousarray(mask[::2, ::2]).astype(np.float32)
        side = (reach | 1, reach | 1)
        self._near = cv2.blur(half, side, borderType=cv2.BORDER_CONSTANT)
        self._hand = cv2.blur(seen[::2, ::2] * half[..., None], side, borderType=cv2.BORDER_CONSTANT)

    def are_of_hand(self, pixels: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Which of these are a mix of the hand's colour nearby, lit more or less, and of the room, more of the hand."""
        seen, room, hand = (*self._known(pixels), self._hand_near(pixels))
        # Least squares: seen = lit * hand + bare * room, all of three channels.
        hh, rr, hr = _squares(hand), _squares(room), _products(hand, room)
        hs, rs = _products(hand, seen), _products(room, seen)
        free = np.maximum(hh * rr - hr**2, 1.0)
        lit, bare = (hs * rr - rs * hr) / free, (rs * hh - hs * hr) / free
        rest = seen - lit[:, None] * hand - bare[:, None] * room
        share = 1 - bare
        light = lit / np.maximum(share, 0.1)
        explained = (hh > 0) & (_squares(rest) < NOISE**2)
        return np.asarray(explained & (share > LEAST_SHARE) & (light > DARKEST) & (light < BRIGHTEST), np.bool_)

    def are_clearly_room(self, pixels: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Of which of these, where the room is seen, the hand's colour is clearly another."""
        _, room = self._known(pixels)
        return np.asarray(_squares(self._hand_near(pixels) - room) > CLEARLY**2, np.bool_)

    def _known(self, pixels: NDArray[np.intp]) -> tuple[Colours, Colours]:
        return self._seen[pixels].astype(np.float32), self._room[pixels].astype(np.float32)

    def _hand_near(self, pixels: NDArray[np.intp]) -> Colours:
        """(n, 3), 0 where the hand is too far away."""
        rows, columns = np.divmod(pixels, self._width)
        at = rows // 2, columns // 2
        return np.asarray(self._hand[at] / np.maximum(self._near[at], 1e-6)[:, None])


def _squares(one: Colours) -> Colours:
    return _products(one, one)


def _products(one: Colours, other: Colours) -> Colours:
    """Sum over the channels, the last axis."""
    return np.asarray(one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1] + one[..., 2] * other[..., 2])


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
