"""Which posture a hand is in, by its outline: index alone, open palm, fist, thumb, another; or unknown, where that is hidden.

To count what stands out of a fist took 30 % of all other signs for an index finger: thumbs, little fingers, two fingers side by
side, flat hands seen from their edge. A small network that was fitted on outlines of hands of any shape, seen from anywhere
(`posture.onnx`, by fitting/fit_posture.py), knows these, and says how sure it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import cv2
import numpy as np
from deixis_schemas.messages import HandPosture
from numpy.typing import NDArray

from .hand import CELLS, CHEST, HandShape

Floats = NDArray[np.float32]
NAMED: tuple[HandPosture, ...] = ("index", "open", "fist", "thumb", "other")
"""In the order of the network's answers."""
SIDE, RADIUS, PALM_AT = 32, 5.0, (15.5, 21.0)
"""The network sees a square of so many pixels, a palm's radius as so many, and the palm there; the arm goes up."""
SURE = 0.6
"""A posture that is less likely than this is unknown. Of hands of held-out people that are then called an index finger alone,
80 in a hundred are (`python fitting/fit_posture.py` prints it)."""


@dataclass(frozen=True)
class PostureOdds:
    """How likely each of NAMED is; they sum to 1."""

    shares: tuple[float, ...]

    @property
    def named(self) -> HandPosture:
        """The likeliest, where it is sure."""
        best = max(range(len(NAMED)), key=self.shares.__getitem__)
        return NAMED[best] if self.shares[best] >= SURE else "unknown"


def posture_of(hand: HandShape) -> PostureOdds:
    """What the outline of one frame shows."""
    return PostureOdds(tuple(float(share) for share in _shares(raster_of(hand))))


def mean_of(seen: list[PostureOdds]) -> PostureOdds:
    """Of several frames, one at least: outlines flicker, and a hand that is held does not."""
    return PostureOdds(tuple(np.mean([odds.shares for odds in seen], axis=0).tolist()))


def raster_of(hand: HandShape) -> Floats:
    """The hand as the network sees it, (SIDE, SIDE) of 0 to 1: as large as its palm and turned by the way from the chest, so
    that neither distance nor where the arm points matters.
    """
    up = math.atan2(hand.palm[1] - CHEST[1], hand.palm[0] - CHEST[0]) + math.pi / 2
    scale = RADIUS / (max(hand.palm_radius, 1 / CELLS) * CELLS)
    cosine, sine = scale * math.cos(up), scale * math.sin(up)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    palm = (np.array(hand.palm) - np.array(hand.origin)) * CELLS
    warp = np.column_stack([turn, np.array(PALM_AT) - turn @ palm])
    mask = hand.mask * np.uint8(255)
    if scale < 1:
        mask = np.asarray(cv2.GaussianBlur(mask, (0, 0), 0.45 / scale), np.uint8)
    seen = cv2.warpAffine(mask, warp, (SIDE, SIDE), flags=cv2.INTER_LINEAR)
    return np.asarray(seen.astype(np.float32) / np.float32(255), np.float32)


def _shares(raster: Floats) -> Floats:
    network = load_network()
    network.setInput(raster[None, None])
    told = np.asarray(network.forward()[0], np.float32)
    odds = np.exp(told - told.max())
    return np.asarray(odds / odds.sum(), np.float32)


@cache
def load_network() -> cv2.dnn.Net:
    """The network, read once. OpenCV runs it, which the stage needs anyway. Raises RuntimeError where its build cannot."""
    weights = np.frombuffer(files("deixis_gesture").joinpath("posture.onnx").read_bytes(), np.uint8)
    try:
        return cv2.dnn.readNetFromONNX(weights)
    except cv2.error as error:
        raise RuntimeError(f"posture.onnx: OpenCV {cv2.__version__} cannot read it ({error})") from None
