"""Persons as messages: pixels of the working picture become those of the frame, head widths become face widths."""

from __future__ import annotations

import cv2
import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M, HEAD_WIDTH_M
from deixis_schemas.messages import KindProbabilities, Track

from deixis_tracker.hands import outline
from deixis_tracker.persons import HandTrack, Person
from deixis_tracker.views import Box, around, to_frame

SHOWN_EVIDENCE = 0.25
SHOWN_AFTER_S = 0.06  # of watching
SHOWN_LOST_S = 0.2  # a hand is published so long after it was seen last


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
