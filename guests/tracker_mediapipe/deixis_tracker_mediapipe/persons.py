"""Who is followed: faces from frame to frame, and the hands that are theirs. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from .config import TrackerConfig
from .outline import Contour, centroid_of, outline_of
from .regions import HandRegion
from .seen import FaceSeen, HandSeen, Point, Region

FACE_BY_BOX = 1.02
"""A face ear to ear (`anatomy.FACE_WIDTH_M`) by the side of the detector's box: on faces of the labelled clips turned by less
than 90 degrees boxes are .98 of it (.08 standard deviation)."""
FACE_BELOW_EARS = 0.06
"""The middle between chin and brow is so far below that between the ears, face widths; from the same clips."""
FRONTAL_NOSE = 0.12
"""Box sides from between the ears to the nose: less in a face turned by less than some 10 degrees."""
SAME_FACE, SAME_HAND = 1.2, 1.3
"""Face widths from where it is expected within which a face or a hand is the same."""
SAME_SIZE = 1.6
LOOKS = 2
"""A face is a person's when it has been seen so often: the detector takes a thing for a face now and then, for one frame."""
FARTHEST_HAND = 6.5
"""Face widths from the middle of the face to a hand: a stretched arm, and the hand nearer to the camera than the face."""
ONE_HAND = 0.45
"""Face widths within which two hands of two looks are one."""
SMOOTH_S, WIDTH_S = 0.05, 0.4
MOST_ODDS, LEAST_SIDE = 3.0, 0.02
ODDS_A_LOOK = 0.35
"""Looks in a row resemble each other: each counts for so much of its own log-odds."""
OWN_SIDE = 1.5
"""Log-odds that a hand is of the side where it is seen, for each face width beside the face. The model takes both hands of some
people for the other one; those that point across the body it gets right (clips two_persons and c19 of the labelled set)."""


@dataclass
class HandTrack:
    """One hand over time. odds: log-odds that it is the person's own left one, of all looks. outline: empty while unseen."""

    track_id: int
    centroid: Point
    width: float
    seen_s: float
    outline: Contour
    odds: float = 0.0
    velocity: Point = (0.0, 0.0)
    observed: bool = True
    is_left: bool = False


@dataclass
class Person:
    """One person. width: of the face, ear to ear as from the front, pixels; centre: between chin and brow."""

    person_id: int
    track_id: int
    centre: Point
    width: float
    seen_s: float
    face: FaceSeen | None
    velocity: Point = (0.0, 0.0)
    looks: int = 1
    hands: list[HandTrack] = field(default_factory=list)
    region: HandRegion = field(default_factory=HandRegion)

    @property
    def observed(self) -> bool:
        """Seen in this frame."""
        return self.face is not None


class Persons:
    """Everybody who is followed. Each frame: `see_faces`, then the hands of `regions`, then `see_hands`."""

    def __init__(self, config: TrackerConfig) -> None:
        self._config = config
        self._person_ids, self._track_ids = count(), count()
        self._all: list[Person] = []
        self._now_s = 0.0
        self.left_out = 0  # faces of the last frame that nobody follows, for `max_persons` are followed already

    @property
    def shown(self) -> list[Person]:
        """Those seen often enough."""
        return [person for person in self._all if person.looks >= LOOKS]

    def forget(self) -> None:
        """Begin anew; ids go on."""
        self._all = []

    def see_faces(self, faces: Sequence[FaceSeen], now_s: float) -> None:
        """The faces of the next frame, at `now_s` (steady, seconds)."""
        passed_s, self._now_s = max(0.0, now_s - self._now_s), now_s
        for person in self._all:
            person.face = None
            person.centre = _moved(person.centre, person.velocity, passed_s)
        rest = list(faces)
        for _, person, face in sorted(self._fits(faces), key=lambda fit: fit[0]):
            if person.face is None and any(face is other for other in rest):
                rest = [other for other in rest if other is not face]
                _follow_face(person, face, passed_s, now_s)
        # A face that was there for one look was none.
        self._all = [p for p in self._all if p.observed or (p.looks >= LOOKS and self._is_near(p.seen_s))]
        for person in self._all:
            if not person.observed:  # it may have stopped as well
                person.velocity = person.velocity[0] * 0.7, person.velocity[1] * 0.7
        self.left_out = 0
        for face in sorted(rest, key=lambda seen: -seen.side):
            self._welcome(face)

    def regions(self, size: tuple[int, int]) -> dict[int, Region]:
        """Where to look for hands in a picture of that size (width, height), by person_id."""
        return {person.person_id: person.region.about(person.centre, person.width, size) for person in self.shown}

    def see_hands(self, hands: Sequence[HandSeen]) -> None:
        """The hands of this frame, of all regions; one that was seen in two regions is one."""
        for person in self._all:
            for hand in person.hands:
                hand.observed = False
        measured = [(seen, outline) for seen in hands if len(outline := outline_of(seen.points))]
        placed = [(seen, outline, centroid_of(outline, seen.points)) for seen, outline in measured]
        taken: list[Point] = []
        for seen, outline, centroid in sorted(placed, key=lambda item: abs(item[0].left - 0.5), reverse=True):
            owner = self._owner(centroid)
            if owner is None or any(math.dist(centroid, other) < ONE_HAND * owner.width for other in taken):
                continue
            taken.append(centroid)
            self._follow_hand(owner, seen, outline, centroid)
        for person in self._all:
            person.hands = [hand for hand in person.hands if self._now_s - hand.seen_s <= self._config.forget_hand_s]
            _tell_sides(person)

    def _fits(self, faces: Sequence[FaceSeen]) -> list[tuple[float, Person, FaceSeen]]:
        found = []
        for person in self._all:
            for face in faces:
                width = FACE_BY_BOX * face.side
                far = math.dist(person.centre, centre_of(face)) / max(width, person.width)
                if far < SAME_FACE and 1 / SAME_SIZE < width / person.width < SAME_SIZE:
                    found.append((far, person, face))
        return found

    def _is_near(self, seen_s: float) -> bool:
        return self._now_s - seen_s <= self._config.forget_face_s

    def _welcome(self, face: FaceSeen) -> None:
        if len(self._all) >= self._config.max_persons:
            self.left_out += 1
            return
        width = FACE_BY_BOX * face.side
        self._all.append(Person(next(self._person_ids), next(self._track_ids), centre_of(face), width, self._now_s, face))

    def _owner(self, centroid: Point) -> Person | None:
        """Whose hand is there: who has one near that place already, else whose face is nearest; nobody's where all are far."""
        near = [(math.dist(centroid, p.centre) / p.width, p) for p in self.shown]
        reachable = [(far, person) for far, person in near if far <= FARTHEST_HAND]
        if not reachable:
            return None
        for _, person in reachable:
            if any(math.dist(_expected(hand, self._now_s), centroid) < ONE_HAND * person.width for hand in person.hands):
                return person
        return min(reachable, key=lambda item: item[0])[1]

    def _follow_hand(self, person: Person, seen: HandSeen, outline: Contour, centroid: Point) -> None:
        free = [hand for hand in person.hands if not hand.observed]
        near = [(math.dist(_expected(hand, self._now_s), centroid) / person.width, hand) for hand in free]
        far, hand = min(near, key=lambda item: item[0], default=(math.inf, None))
        if hand is None or far > SAME_HAND:
            if sum(other.observed for other in person.hands) >= 2:
                return
            hand = HandTrack(next(self._track_ids), centroid, person.width, self._now_s, outline)
            person.hands.append(hand)
        passed_s = self._now_s - hand.seen_s
        if passed_s > 0:
            hand.velocity = _smoothed(hand.velocity, hand.centroid, centroid, passed_s)
        hand.centroid, hand.width, hand.outline = centroid, person.width, outline
        hand.seen_s, hand.observed = self._now_s, True
        share = min(max(seen.left, LEAST_SIDE), 1 - LEAST_SIDE)
        hand.odds = min(max(hand.odds + ODDS_A_LOOK * math.log(share / (1 - share)), -MOST_ODDS), MOST_ODDS)


def centre_of(face: FaceSeen) -> Point:
    """The middle of a face between chin and brow, and of the head from side to side."""
    return face.ears[0], face.ears[1] + FACE_BELOW_EARS * FACE_BY_BOX * face.side


def is_frontal(face: FaceSeen) -> bool:
    """Whether the face is seen from the front."""
    return abs(face.nose) < FRONTAL_NOSE


def left_odds(hand: HandTrack, person: Person) -> float:
    """Log-odds that a hand is the person's own left one: of its looks, and of where it is seen."""
    return hand.odds + OWN_SIDE * (hand.centroid[0] - person.centre[0]) / person.width


def _tell_sides(person: Person) -> None:
    """Nobody has two left hands: of two that are seen, the likelier one is."""
    hands = sorted(person.hands, key=lambda hand: left_odds(hand, person))
    for hand in hands:
        hand.is_left = left_odds(hand, person) > 0
    seen = [hand for hand in hands if hand.observed]
    if len(seen) == 2:
        seen[0].is_left, seen[1].is_left = False, True


def _follow_face(person: Person, face: FaceSeen, passed_s: float, now_s: float) -> None:
    centre, lost_s = centre_of(face), now_s - person.seen_s
    before = person.centre[0] - person.velocity[0] * passed_s, person.centre[1] - person.velocity[1] * passed_s
    if passed_s > 0:
        person.velocity = _smoothed(person.velocity, before, centre, passed_s)
    share = 1 - math.exp(-max(lost_s, 1e-3) / WIDTH_S)
    person.width += share * (FACE_BY_BOX * face.side - person.width)
    person.centre, person.face, person.seen_s = centre, face, now_s
    person.looks += 1


def _smoothed(velocity: Point, before: Point, now: Point, passed_s: float) -> Point:
    share = 1 - math.exp(-passed_s / SMOOTH_S)
    x, y = ((b - a) / passed_s for a, b in zip(before, now, strict=True))
    return velocity[0] + share * (x - velocity[0]), velocity[1] + share * (y - velocity[1])


def _moved(place: Point, velocity: Point, passed_s: float) -> Point:
    return place[0] + velocity[0] * passed_s, place[1] + velocity[1] * passed_s


def _expected(hand: HandTrack, now_s: float) -> Point:
    return _moved(hand.centroid, hand.velocity, min(now_s - hand.seen_s, 0.1))


def sigmoid(odds: float) -> float:
    """Probability of log-odds."""
    return float(1 / (1 + np.exp(-odds)))
