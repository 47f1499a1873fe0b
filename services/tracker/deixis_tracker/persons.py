"""What the tracker knows of one person: a head and up to a few hands."""

from __future__ import annotations

from dataclasses import dataclass, field

from deixis_tracker.boxes import Box, around
from deixis_tracker.classifier import HandBelief, HandKind
from deixis_tracker.hands import Hand
from deixis_tracker.heads import HeadColours
from deixis_tracker.hypotheses import Points
from deixis_tracker.kalman import PointFilter

MOST_HANDS = 4

# The face box, in published widths around the head's centre: chin to brow lies a little below the middle of the head.
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
    frames: int = 1
    on_arm: bool = False  # the hand was cut from a longer blob when it was seen last

    @property
    def last_seen(self) -> tuple[float, float]:
        """Middle of the pixels seen last."""
        x, y = self.pixels.mean(axis=0)
        return float(x), float(y)


@dataclass
class Person:
    """One tracked person. Positions are pixels of the working picture; `width` is the published face width."""

    person_id: int
    track_id: int
    motion: PointFilter
    width: float
    colours: HeadColours
    seen_ns: int
    support: float = 1.0
    observed: bool = True
    frontal: bool = True
    frontal_hits: int = 1
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

    def face_box(self) -> Box:
        """The face, chin to brow, ear to ear; around the head's centre also when the head is turned away."""
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
