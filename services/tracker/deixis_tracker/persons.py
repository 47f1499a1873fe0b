"""What the tracker knows of one person, a head and up to a few hands, and how it is published.

The unit of length is the head's width: that of its outline from the front, `anatomy.HEAD_WIDTH_M`. Messages are in pixels
of the frame, and their faces as wide as `anatomy.FACE_WIDTH_M`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M, HEAD_WIDTH_M
from deixis_schemas.messages import FrontalFace, KindProbabilities, Track

from deixis_tracker.camera_motion import Shift
from deixis_tracker.classifier import HandBelief, HandKind
from deixis_tracker.finder import Surroundings
from deixis_tracker.frame import COARSE, Box, Mask, around, to_frame
from deixis_tracker.hands import Hand, outline
from deixis_tracker.heads import HeadColours
from deixis_tracker.hypotheses import Points
from deixis_tracker.kalman import PointFilter

MOST_HANDS = 4
HANGING = 3.4  # head widths below the head: lower a hand is at rest (the gesture stage reads outlines down to 3.6 face widths)

# Chin and brow, in head widths from the head's centre: they lie a little below the middle of the head.
FACE_ABOVE, FACE_BELOW = 0.52, 0.66

SHOWN_EVIDENCE = 0.25
SHOWN_AFTER_S = 0.06  # of watching
QUICK, QUICK_NEAR = 4.0, 1.5  # head widths a second; head widths from such a hand that an earlier look says nothing of
SHOWN_LOST_S = 0.2  # a hand is published so long after it was seen last


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
    as_seen_ns: int = -(10**18)  # when the hand was cut out last where the finder saw it
    elsewhere_ns: int = -(10**18)  # when the finder saw it last in another place than it was cut out, and since when
    elsewhere_since_ns: int = 0
    likely_ns: int = -(10**18)  # when the finder took it last for what may be a hand
    on_arm: bool = False  # the hand was cut from a longer blob when it was seen last
    _middle: tuple[Points | None, tuple[float, float]] = field(default=(None, (0.0, 0.0)), repr=False, compare=False)

    @property
    def last_seen(self) -> tuple[float, float]:
        """Middle of the pixels seen last."""
        pixels, middle = self._middle
        if pixels is not self.pixels:  # they are replaced, never changed; and this is asked for again and again
            x, y = self.pixels.mean(axis=0)
            middle = float(x), float(y)
            self._middle = self.pixels, middle
        return middle


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
    face_ns: int = -(10**18)  # when its face was seen from the front and uncovered last
    no_face_ns: int = -(10**18)  # when it was looked for there last and not seen
    back_ns: int = -(10**18)  # when it was seen so again, after it was turned away or covered
    support: float = 1.0
    observed: bool = True
    sightings: int = 0  # of a frontal face, that corrected the head
    measured: int = 0  # times
    frontal: FrontalFace | None = None  # as measured in this frame, in its pixels
    skin_centre: tuple[float, float] | None = None
    hands: list[HandTrack] = field(default_factory=list)
    around: Surroundings | None = None  # what the finder saw around the head
    around_ns: int = -(10**18)  # when

    @property
    def x(self) -> float:
        """Head centre."""
        return self.motion.x

    @property
    def y(self) -> float:
        """Head centre."""
        return self.motion.y

    def move(self, shift: Shift) -> None:
        """Move head and hands with the room, where the camera moved: what is left of their motion is their own."""
        self.motion.shift_to(*shift.moved(self.x, self.y))
        if self.around is not None:
            self.around = self.around.moved(shift)
        for hand in self.hands:
            x, y = hand.motion.x, hand.motion.y
            hand.motion.shift_to(*shift.moved(x, y))
            hand.pixels = np.asarray(hand.pixels + np.array([hand.motion.x - x, hand.motion.y - y]), np.float32)

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

    def is_outdated(self, x: float, y: float, now_ns: int) -> bool:
        """Whether what the finder saw at a place is of an earlier frame, and a hand of the person moves there quickly."""
        return self.around_ns < now_ns and any(
            math.hypot(hand.motion.vx, hand.motion.vy) > QUICK * self.width
            and math.hypot(hand.motion.x - x, hand.motion.y - y) < QUICK_NEAR * self.width
            for hand in self.hands
        )

    def hangs(self, hand: HandTrack) -> bool:
        """Whether a hand is so low that it is held out nowhere."""
        return hand.motion.y > self.y + HANGING * self.width

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


def is_shown(hand: HandTrack) -> bool:
    """Whether a track is surely a hand."""
    return hand.kind != "unknown" and hand.evidence >= SHOWN_EVIDENCE and hand.watched_s >= SHOWN_AFTER_S


def tracks_of(person: Person, now_ns: int, scale: float) -> list[Track]:
    """Face and hands of a person at `now_ns`, in pixels of the frame, `scale` of which are one of the working picture."""
    hands = [hand for hand in person.hands if is_shown(hand) and now_ns - hand.seen_ns <= SHOWN_LOST_S * 1e9]
    return [_face(person, scale), *(_hand(person, hand, scale) for hand in hands)]


def _face(person: Person, scale: float) -> Track:
    box = person.head_box()
    rim = (1 - FACE_WIDTH_M / HEAD_WIDTH_M) / 2 * box.w
    trust = min(1.0, max(0.05, 0.5 + person.support)) if person.observed else 0.3
    return Track(
        track_id=person.track_id,
        person_id=person.person_id,
        kind="face",
        kind_probabilities=KindProbabilities(face=trust, unknown=1 - trust),
        centroid_px=to_frame(*(person.skin_centre or box.centre), scale),
        bbox_px=_box(Box(box.x + rim, box.y, box.w - 2 * rim, box.h), scale),
        velocity_px_s=(person.motion.vx * scale, person.motion.vy * scale),
        frontal=person.frontal,
        observed=person.observed,
        confidence=trust,
    )


def _hand(person: Person, hand: HandTrack, scale: float) -> Track:
    probabilities = hand.belief.probabilities()
    contour = outline(hand.blob) if hand.blob else np.empty((0, 2), np.int32)
    in_frame = np.rint((contour + 0.5) * scale - 0.5) if scale != 1 else contour
    return Track(
        track_id=hand.track_id,
        person_id=person.person_id,
        kind=hand.kind,
        kind_probabilities=probabilities,
        centroid_px=to_frame(*(hand.blob.centroid if hand.blob else (hand.motion.x, hand.motion.y)), scale),
        bbox_px=_box(Box(*cv2.boundingRect(contour)) if len(contour) else _predicted_box(hand), scale),
        velocity_px_s=(hand.motion.vx * scale, hand.motion.vy * scale),
        contour=in_frame.astype("<i2").tobytes(),
        observed=hand.blob is not None,
        confidence=float(getattr(probabilities, hand.kind)),
    )


def _box(box: Box, scale: float) -> tuple[float, float, float, float]:
    return (*to_frame(box.x, box.y, scale), box.w * scale, box.h * scale)


def _predicted_box(hand: HandTrack) -> Box:
    """The box of the last blob seen, where the hand is predicted now."""
    w, h = (float(v) for v in hand.pixels.max(axis=0) - hand.pixels.min(axis=0))
    return around(hand.motion.x, hand.motion.y, w / 2, h / 2, w / 2, h / 2)
