"""Persons as the contract has them: a face's box as wide as every face, hands with packed outlines."""

from __future__ import annotations

import cv2
import numpy as np
from deixis_schemas.messages import MAX_SIDE_PX, FrontalFace, KindProbabilities, Track

from .persons import HandTrack, Person, is_frontal, left_odds, sigmoid
from .seen import Point

FACE_HEIGHT = 1.3
"""Chin to brow, by the width."""
FARTHEST_PX = 32000.0
"""Pixels that an int16, and the contract, hold; a prediction may leave the picture."""


def tracks_of(person: Person) -> list[Track]:
    """The face of a person, then the hands."""
    return [_face(person), *(_hand(hand, person) for hand in person.hands)]


def _face(person: Person) -> Track:
    x, y = _bounded(person.centre)
    width, seen = min(person.width, MAX_SIDE_PX / FACE_HEIGHT), person.face
    frontal = FrontalFace(centre_px=(x, y), width_px=width) if seen is not None and is_frontal(seen) else None
    return Track(
        track_id=person.track_id,
        person_id=person.person_id,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(x, y),
        bbox_px=(x - width / 2, y - FACE_HEIGHT * width / 2, width, FACE_HEIGHT * width),
        velocity_px_s=_bounded(person.velocity),
        frontal=frontal,
        observed=person.observed,
        confidence=min(1.0, seen.score) if seen is not None else 0.5,
    )


def _hand(hand: HandTrack, person: Person) -> Track:
    left = sigmoid(left_odds(hand, person))
    left = max(left, 0.5) if hand.is_left else min(left, 0.5)
    contour = np.clip(hand.outline, -FARTHEST_PX, FARTHEST_PX) if hand.observed else hand.outline[:0]
    x, y, width, height = cv2.boundingRect(hand.outline)
    return Track(
        track_id=hand.track_id,
        person_id=person.person_id,
        kind="left_hand" if hand.is_left else "right_hand",
        kind_probabilities=KindProbabilities(left_hand=left, right_hand=1 - left),
        centroid_px=_bounded(hand.centroid),
        bbox_px=(float(x), float(y), float(width), float(height)),
        velocity_px_s=_bounded(hand.velocity),
        contour=contour.astype("<i2").tobytes(),
        observed=hand.observed,
        confidence=max(left, 1 - left),
    )


def _bounded(point: Point) -> Point:
    x, y = (min(max(value, -FARTHEST_PX), FARTHEST_PX) for value in point)
    return x, y
