"""Blobs of hands that the finder sees by their shape and that colour did not give.

Dark skin in poor light, gloves, a grey camera or a wall of the colour of skin leave no blob of skin; the finder sees hands all
the same. What belongs to such a hand is what has the colour of its middle, near by.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import HAND, Maps, Seen
from deixis_tracker.frame import COARSE, Box, Image, Mask, Step, Views, around
from deixis_tracker.hands import LEAST_THICKNESS, thickness
from deixis_tracker.median import median
from deixis_tracker.persons import Person, is_shown
from deixis_tracker.segmentation import Blob

REACH, MIDDLE, USUAL = 0.62, 0.14, 0.3  # head widths: farthest part of a hand, what is surely hand, a hand taken for a disk
BESIDE = 1.6  # head widths from the head; nearer, shoulders of arms that move pass for hands
CHIN = 0.7  # head widths below the head
# Share of a hand's place that differs from the room, so near the head, and log odds beyond doubtful ones by which it needs not.
CAME, CAME_NEAR, VERY_SURELY = 0.15, 0.6, 1.5
FOREARM = 2.2  # head widths from hand to arm
# Log odds of the finder below which there is surely no hand. This and what is below were chosen by
# `deixis eval --stage tracker --seeds 1000:1016` and the known clips: hardly a true hand has less.
NO_HAND = -1.0
# Near a hand that was tracked so lately, places are believed down to so far below doubtful odds: near one that is surely
# a hand, or where something has come before the room. What is doubtful and stands in the room does not keep itself alive.
KEPT_ODDS, KEPT_SEEN_S = 1.0, 0.3
INSIDE = 0.5  # share of a blob that lies where the finder sees the hand
COVERED = 0.25  # share of the square about a hand's middle
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


def found_hands(
    views: Views, unknown: Mask, persons: list[Person], blobs: list[Blob], config: TrackerConfig, step: Step
) -> list[Blob]:
    """All blobs: `blobs` without bare arms, and the hands of these persons that none of them shows well.

    `unknown`: 255 where the room is not known, at coarse resolution.
    """
    telling = np.asarray(cv2.bitwise_or(views.changed, unknown), np.uint8)
    places = hand_places(telling, persons, config, step)
    # Of a hand that has moved on since the finder looked, blobs of skin say more.
    current = [place for place in places if not place.person.is_outdated(place.hand.x, place.hand.y, step.now_ns)]
    pieces = {id(place): [blob for blob in blobs if _is_piece(blob, place, config)] for place in current}
    joined = {id(blob) for parts in pieces.values() for blob in parts}
    whole = [blob for blob in blobs if id(blob) not in joined]
    missing = [place for place in places if not any(_covers(blob, place) for blob in whole)]
    arms = {id(blob) for blob in whole for place in missing if id(place) in pieces and _is_arm(blob, place)}
    found = [_blob(views, place, pieces.get(id(place), []), config) for place in missing]
    return [blob for blob in whole if id(blob) not in arms] + [blob for blob in found if blob.area]


def hand_places(telling: Mask, persons: list[Person], config: TrackerConfig, step: Step) -> list[Place]:
    """Of each person two places at most, the surest first; a place that two see belongs to whom it fits better.

    `telling`: 255 where something has come before the room, or where the room is not known, at coarse resolution.
    """
    seen = [place for person in persons for place in _places(telling, person, config, step)]
    kept: list[Place] = []
    for place in sorted(seen, key=lambda place: -place.hand.odds):
        if all(_apart(place, other) for other in kept):
            kept.append(place)
    return kept


def _places(telling: Mask, person: Person, config: TrackerConfig, step: Step) -> list[Place]:
    if person.around is None:
        return []
    places: list[Place] = []
    for hand in person.around.hands(HAND, config.hand_odds - KEPT_ODDS):
        place = Place(person, hand)
        came = _came(telling, place)
        sure = hand.odds >= config.hand_odds or _is_followed(place, came, step)
        if sure and _may_be_there(place, came, config) and all(_apart(place, other) for other in places):
            places.append(place)
    return places[:2]


def _came(telling: Mask, place: Place) -> float:
    """Share of a place where something has come before the room."""
    half = USUAL * place.person.width
    rows, columns = around(place.hand.x, place.hand.y, half, half, half, half).scaled(COARSE).window(*telling.shape)
    part = telling[rows, columns]
    return np.count_nonzero(part) / max(1, part.size)


def _is_followed(place: Place, came: float, step: Step) -> bool:
    """Whether a hand was there just now: one that is held still is not lost where the finder doubts."""
    return any(
        step.now_ns - hand.likely_ns <= KEPT_SEEN_S * 1e9
        and (came >= CAME_NEAR or is_shown(hand))
        and math.dist(hand.last_seen, (place.hand.x, place.hand.y)) < REACH * place.person.width
        for hand in place.person.hands
    )


def _may_be_there(place: Place, came: float, config: TrackerConfig) -> bool:
    """Within reach, no shoulder, and where something has come before the room, unless the hand is seen very surely."""
    person, hand = place.person, place.hand
    away = person.distance(hand.x, hand.y)
    near = away < BESIDE
    if away >= config.reach or (near and hand.y > person.y + CHIN * person.width):
        return False
    return came >= (CAME_NEAR if near else CAME) or (not near and hand.odds >= config.hand_odds + VERY_SURELY)


def _is_piece(blob: Blob, place: Place, config: TrackerConfig) -> bool:
    """Whether a blob is a piece of that hand that is too small or too thin to be taken for one."""
    w = place.person.width
    poor = blob.area < config.min_hand_area * w * w or thickness(blob.mask) < LEAST_THICKNESS * w
    return poor and _lies_in(blob, place)


def _lies_in(blob: Blob, place: Place) -> bool:
    """Whether most of a blob lies where the hand may be."""
    left, top = place.box.x - blob.x0, place.box.y - blob.y0
    rows, columns = place.box._replace(x=left, y=top).window(*blob.mask.shape)
    return bool(np.count_nonzero(blob.mask[rows, columns]) >= INSIDE * blob.area)


def _is_arm(blob: Blob, place: Place) -> bool:
    """Whether a blob is the forearm of that hand, which has another colour or lies before the head: near, and no hand."""
    person, hand = place.person, place.hand
    assert person.around is not None
    rows, columns = np.nonzero(blob.mask)
    if np.hypot(columns + blob.x0 - hand.x, rows + blob.y0 - hand.y).min() > FOREARM * person.width:
        return False
    return not any(_is_on(blob, other) for other in person.around.hands(HAND, NO_HAND))


def _is_on(blob: Blob, hand: Seen) -> bool:
    row, column = round(hand.y - blob.y0), round(hand.x - blob.x0)
    return 0 <= row < blob.mask.shape[0] and 0 <= column < blob.mask.shape[1] and bool(blob.mask[row, column])


def _apart(place: Place, other: Place) -> bool:
    gap = np.hypot(place.hand.x - other.hand.x, place.hand.y - other.hand.y)
    return bool(gap >= ONE_HAND * max(place.person.width, other.person.width))


def _covers(blob: Blob, place: Place) -> bool:
    """Whether a blob has a good part of where the hand is, or is the hand's better part."""
    half = USUAL * place.person.width
    box = around(place.hand.x - blob.x0, place.hand.y - blob.y0, half, half, half, half)
    rows, columns = box.window(*blob.mask.shape)
    return bool(np.count_nonzero(blob.mask[rows, columns]) >= COVERED * (2 * half) ** 2) or _lies_in(blob, place)


def _blob(views: Views, place: Place, pieces: list[Blob], config: TrackerConfig) -> Blob:
    """What has the colour of the hand's middle and hangs together with it, and its pieces; a disk where that is no hand's
    size.
    """
    w, hand = place.person.width, place.hand
    rows, columns = place.box.window(*views.full.shape[:2])
    x, y = np.arange(columns.start, columns.stop) - hand.x, np.arange(rows.start, rows.stop) - hand.y
    away = np.asarray(np.hypot(x, y[:, None]) / w, np.float32)
    mask = _about_middle(_alike(views.full[rows, columns], away), away)
    if not config.min_hand_area * w * w <= np.count_nonzero(mask) <= MOST_AREA * w * w:
        mask = np.asarray(away <= USUAL, np.uint8)
    for piece in pieces:
        _paste(piece, mask, columns.start, rows.start)
    evidence = float(1 / (1 + np.exp(config.hand_odds - min(hand.odds, 10.0))))
    return Blob(mask, columns.start, rows.start, int(np.count_nonzero(mask)), evidence, SURE, place.person.person_id)


def _paste(piece: Blob, mask: Mask, x0: int, y0: int) -> None:
    """Add what of a piece lies in the window of a mask whose corner is at (x0, y0)."""
    rows, columns = np.nonzero(piece.mask)
    rows, columns = rows + piece.y0 - y0, columns + piece.x0 - x0
    inside = (rows >= 0) & (rows < mask.shape[0]) & (columns >= 0) & (columns < mask.shape[1])
    mask[rows[inside], columns[inside]] = 1


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
