"""What the tracker knows of one person: a head and up to a few hands.

The unit of length is the head's width: that of its outline from the front, `anatomy.HEAD_WIDTH_M`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from deixis_schemas.messages import FrontalFace

from deixis_tracker.classifier import HandBelief, HandKind
from deixis_tracker.hands import Hand
from deixis_tracker.heads import HeadColours
from deixis_tracker.hypotheses import Points
from deixis_tracker.kalman import PointFilter
from deixis_tracker.views import COARSE, Box, Mask, around

MOST_HANDS = 4

# Chin and brow, in head widths from the head's centre: they lie a little below the middle of the head.
FACE_ABOVE, FACE_BELOW = 0.52, 0.66


@dataclass
class HandTrack:
    """One hand-like blob over time."""

    track_id: int
    motion: PointFilter
    pixels: Points
    blob: Hand | None
    seen_ns: int
    kind: HandKind = "unknown"
    belief: HandBelief = field(default_factory=HandBelief)
    evidence: float = 0.0
    watched_s: float = 0.0  # time in which it was seen
    on_arm: bool = False  # the hand was cut from a longer blob when it was seen last

    @property
    def last_seen(self) -> tuple[float, float]:
        """Middle of the pixels seen last."""
        x, y = self.pixels.mean(axis=0)
        return float(x), float(y)


@dataclass
class Person:
    """One tracked person. Positions are pixels of the working picture; `width` is the head's."""

    person_id: int
    track_id: int
    motion: PointFilter
    width: float
    colours: HeadColours
    since_ns: int
    seen_ns: int
    face_ns: int  # when its face was seen from the front and uncovered last
    back_ns: int = -(10**18)  # when it was seen so again, after it was turned away or covered
    support: float = 1.0
    observed: bool = True
    sightings: int = 1  # of a frontal face, that corrected the head
    measured: int = 0  # times
    frontal: FrontalFace | None = None  # as measured in this frame, in its pixels
    skin_centre: tuple[float, float] | None = None
    hands: list[HandTrack] = field(default_factory=list)

    @property
    def x(self) -> float:
        """Head centre."""
        return self.motion.x

    @property
    def y(self) -> float:
        """Head centre."""
        return self.motion.y

    def head_box(self) -> Box:
        """Chin to brow, as wide as the head; around the head's centre also when the head is turned away."""
        half = self.width / 2
        return around(self.x, self.y, half, FACE_ABOVE * self.width, half, FACE_BELOW * self.width)

    def body_box(self) -> Box:
        """Where the body may be, arms hanging."""
        w = self.width
        return around(self.x, self.y, 2.1 * w, 1.2 * w, 2.1 * w, 8.5 * w)

    def resting_hands_box(self) -> Box:
        """Where hands hang. Above it a hand is raised, and has come there since the room was learned."""
        w = self.width
        return Box(self.x - 1.7 * w, self.y + 2.4 * w, 3.4 * w, 3.8 * w)

    def shoulder(self, x: float) -> tuple[float, float]:
        """The shoulder on the side of the picture where `x` is."""
        side = 1.0 if x > self.x else -1.0
        return self.x + 0.9 * side * self.width, self.y + 1.35 * self.width

    def distance(self, x: float, y: float) -> float:
        """From the head's centre, head widths."""
        return math.hypot(x - self.x, y - self.y) / self.width


def people_mask(persons: list[Person], shape: tuple[int, int]) -> Mask:
    """255 where people are or may be, at coarse resolution: there the room is not learned."""
    mask = np.zeros(shape, np.uint8)
    for person in persons:
        margin = 0.8 * person.width
        hands = [around(hand.motion.x, hand.motion.y, margin, margin, margin, margin) for hand in person.hands]
        for box in (person.body_box(), *hands):
            rows, columns = box.scaled(COARSE).window(*shape)
            mask[rows, columns] = 255
    return mask
