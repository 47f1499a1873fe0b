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
from deixis_tracker.frame import Box, Image, Mask, Views, around
from deixis_tracker.median import median
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
    x, y = np.arange(columns.start, columns.stop) - hand.x, np.arange(rows.start, rows.stop) - hand.y
    away = np.asarray(np.hypot(x, y[:, None]) / w, np.float32)
    mask = _about_middle(_alike(views.full[rows, columns], away), away)
    if not config.min_hand_area * w * w <= np.count_nonzero(mask) <= MOST_AREA * w * w:
        mask = np.asarray(away <= USUAL, np.uint8)
    evidence = float(1 / (1 + np.exp(config.hand_odds - min(hand.odds, 10.0))))
    return Blob(mask, columns.start, rows.start, int(np.count_nonzero(mask)), evidence, SURE, place.person.person_id)


def _alike(part: Image, away: Maps) -> Mask:
    """What of a picture (h, w, 3) has the colour of the middle, 0 or 1."""
    middle = away <= MIDDLE
    if np.count_nonzero(middle) < 4:
        return np.zeros(away.shape, np.uint8)
    off = np.zeros(away.shape, np.float32)
    for channel in cv2.split(part):
        levels = channel.astype(np.float32)
        mean = median(levels[middle])
        spread = max(LEAST_SPREAD, float(median(np.abs(levels[middle] - mean))) * 1.5)
        off += ((levels - mean) / np.float32(spread)) ** 2
    alike = np.asarray(((np.sqrt(off / 3) <= ALIKE) & (away <= REACH)) | middle, np.uint8)
    return np.asarray(cv2.medianBlur(alike, 3), np.uint8)


def _about_middle(mask: Mask, away: Maps) -> Mask:
    """The region of a mask in which its pixel nearest to the middle lies."""
    if not mask.any():
        return mask
    _, labels = cv2.connectedComponents(mask, connectivity=8)
    row, column = np.unravel_index(int(np.argmin(np.where(mask > 0, away, np.inf))), away.shape)
    return np.asarray(labels == labels[row, column], np.uint8)
