"""Blobs of hands that the finder sees by their shape and that colour did not give.

Dark skin in poor light, gloves, a grey camera or a wall of the colour of skin leave no blob of skin; the finder sees hands all
the same. What belongs to such a hand is what has the colour of its middle, near by.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import LEFT_HAND, RIGHT_HAND, Maps, Seen
from deixis_tracker.frame import Box, Mask, Views, around
from deixis_tracker.persons import Person
from deixis_tracker.segmentation import Blob

REACH, MIDDLE, USUAL = 0.62, 0.14, 0.3  # head widths: farthest part of a hand, what is surely hand, a hand taken for a disk
BESIDE = 1.6  # head widths from the head; nearer, shoulders of arms that move pass for hands
ONE_HAND = 0.45  # head widths: two places of a hand that are nearer to each other are one
ALIKE = 2.5  # deviations of the colour of what is surely hand
LEAST_SPREAD = 9.0  # grey levels
MOST_AREA = 0.75  # head widths squared
SURE = 0.85  # P(skin) that a hand without skin is given: shape has said what it is


class Place(NamedTuple):
    """Where the finder sees a hand, and of whom."""

    person: Person
    hand: Seen

    @property
    def box(self) -> Box:
        """All that may belong to the hand."""
        reach = REACH * self.person.width
        return around(self.hand.x, self.hand.y, reach, reach, reach, reach)


def found_hands(views: Views, persons: list[Person], blobs: list[Blob], config: TrackerConfig) -> list[Blob]:
    """Blobs of the hands of these persons that none of `blobs` covers."""
    places = [place for place in hand_places(persons, config) if not any(_covers(blob, place) for blob in blobs)]
    return [blob for place in places if (blob := _blob(views, place, config)).area]


def hand_places(persons: list[Person], config: TrackerConfig) -> list[Place]:
    """Of each person one place at most a hand, the surest first; a place that two see belongs to whom it fits better."""
    seen = []
    for person in persons:
        for kind in (RIGHT_HAND, LEFT_HAND):
            hands = (Place(person, hand) for hand in _hands(person, kind, config.hand_odds))
            near = [place for place in hands if BESIDE < person.distance(place.hand.x, place.hand.y) < config.reach]
            seen += near[:1]
    kept: list[Place] = []
    for place in sorted(seen, key=lambda place: -place.hand.odds):
        if all(_apart(place, other) for other in kept):
            kept.append(place)
    return kept


def _hands(person: Person, kind: int, least: float) -> list[Seen]:
    return person.around.hands(kind, least) if person.around is not None else []


def _apart(place: Place, other: Place) -> bool:
    gap = np.hypot(place.hand.x - other.hand.x, place.hand.y - other.hand.y)
    return bool(gap >= ONE_HAND * max(place.person.width, other.person.width))


def _covers(blob: Blob, place: Place) -> bool:
    """Whether a blob has pixels where the hand is."""
    half = USUAL * place.person.width
    box = around(place.hand.x - blob.x0, place.hand.y - blob.y0, half, half, half, half)
    rows, columns = box.window(*blob.mask.shape)
    return bool(blob.mask[rows, columns].any())


def _blob(views: Views, place: Place, config: TrackerConfig) -> Blob:
    """What has the colour of the hand's middle and hangs together with it; a disk where that is no hand's size."""
    w, hand = place.person.width, place.hand
    rows, columns = place.box.window(*views.full.shape[:2])
    y, x = np.mgrid[rows.start : rows.stop, columns.start : columns.stop]
    away = np.asarray(np.hypot(x - hand.x, y - hand.y) / w, np.float32)
    mask = _about_middle(_alike(np.asarray(views.full[rows, columns], np.float32), away), away)
    if not config.min_hand_area * w * w <= np.count_nonzero(mask) <= MOST_AREA * w * w:
        mask = np.asarray(away <= USUAL, np.uint8)
    evidence = float(1 / (1 + np.exp(config.hand_odds - min(hand.odds, 10.0))))
    return Blob(mask, columns.start, rows.start, int(np.count_nonzero(mask)), evidence, SURE, place.person.person_id)


def _alike(part: Maps, away: Maps) -> Mask:
    """What has the colour of the middle, 0 or 1."""
    middle = part[away <= MIDDLE]
    if len(middle) < 4:
        return np.zeros(away.shape, np.uint8)
    mean = np.median(middle, axis=0)
    spread = np.maximum(LEAST_SPREAD, np.median(np.abs(middle - mean), axis=0) * 1.5)
    off = np.sqrt((((part - mean) / spread) ** 2).mean(axis=2))
    alike = np.asarray((off <= ALIKE) & (away <= REACH), np.uint8)
    alike[away <= MIDDLE] = 1
    return np.asarray(cv2.medianBlur(alike, 3), np.uint8)


def _about_middle(mask: Mask, away: Maps) -> Mask:
    """The region of a mask in which its pixel nearest to the middle lies."""
    if not mask.any():
        return mask
    _, labels = cv2.connectedComponents(mask, connectivity=8)
    row, column = np.unravel_index(int(np.argmin(np.where(mask > 0, away, np.inf))), away.shape)
    return np.asarray(labels == labels[row, column], np.uint8)
