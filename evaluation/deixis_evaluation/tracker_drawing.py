"""A frame with what the tracker says of it, in colour, and the truth, in white."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import Track

from .clips import TrueFrame, TruePerson

Picture = npt.NDArray[np.uint8]
Colour = tuple[int, int, int]
Rectangle = tuple[int, int, int, int]

COLOURS: dict[str, Colour] = {
    "face": (80, 220, 80),
    "left_hand": (230, 160, 40),
    "right_hand": (60, 120, 250),
    "unknown": (170, 170, 170),
}
WHITE, BLACK = (255, 255, 255), (0, 0, 0)
SHORT = {"face": "face", "left_hand": "left", "right_hand": "right", "unknown": "unknown"}
NARROW_PX = 800
"""Narrower frames are drawn at twice their size, so that words can be read."""
FONT, LETTERS, LINE_PX = cv2.FONT_HERSHEY_SIMPLEX, 0.45, 16
LEAST_SAID = 0.01
"""Probability of a kind that is written."""
CROSS_PX, RING_PX, DASH_PX = 9, 13, 6


class Label(NamedTuple):
    """Words at a rectangle x, y, width, height."""

    text: str
    at: Rectangle
    colour: Colour


def drawn_scale(width: int) -> int:
    """How many times its size a frame of that width is drawn."""
    return 2 if width < NARROW_PX else 1


def draw_tracks(picture: Picture, tracks: Sequence[Track], truth: TrueFrame, title: str) -> Picture:
    """A frame (h, w, 3) BGR, as a new picture, with its tracks (outlines, boxes, kinds, probabilities, persons) and the truth.

    What is only predicted has a dashed box. Of the truth: the box of each visible face, a cross with R or L on the middle of
    each visible hand, ringed where the hand is raised, and below what each person does. `title` stands below, too.
    """
    scale = drawn_scale(picture.shape[1])
    size = (picture.shape[1] * scale, picture.shape[0] * scale)
    image = np.array(cv2.resize(picture, size, interpolation=cv2.INTER_CUBIC) if scale > 1 else picture, np.uint8)
    for person in truth.persons:
        _draw_truth(image, person, scale)
    for track in tracks:
        _draw_track(image, track, scale)
    _write_all(image, [Label(_said(track), _scaled(track.bbox_px, scale), COLOURS[track.kind]) for track in tracks])
    for number, line in enumerate([*(_done_by(person) for person in reversed(truth.persons)), title]):
        _write(image, line, (8, image.shape[0] - 8 - LINE_PX * number), WHITE)
    return image


def _draw_track(image: Picture, track: Track, scale: int) -> None:
    colour = COLOURS[track.kind]
    x, y, w, h = _scaled(track.bbox_px, scale)
    outline = np.frombuffer(track.contour, "<i2").reshape(-1, 1, 2).astype(np.int32)
    if len(outline):
        cv2.polylines(image, [outline * scale + scale // 2], True, colour, 2, cv2.LINE_AA)
    if track.observed:
        cv2.rectangle(image, (x, y), (x + w, y + h), colour, 1)
    else:
        _dashed(image, (x, y, w, h), colour)


def _draw_truth(image: Picture, person: TruePerson, scale: int) -> None:
    if person.face.bbox_visible is not None:
        x, y, w, h = _scaled(person.face.bbox_visible, scale)
        cv2.rectangle(image, (x, y), (x + w, y + h), WHITE, 1)
        _write(image, f"truth {person.id}", (x, y + h + LINE_PX), WHITE)
    for side, hand in person.hands.sides():
        if hand.centroid_visible_px is None:
            continue
        at = round(hand.centroid_visible_px[0] * scale), round(hand.centroid_visible_px[1] * scale)
        cv2.drawMarker(image, at, WHITE, cv2.MARKER_CROSS, CROSS_PX, 1, cv2.LINE_AA)
        if side == person.raised:
            cv2.circle(image, at, RING_PX, WHITE, 1, cv2.LINE_AA)
        _write(image, side[0].upper(), (at[0] + CROSS_PX, at[1] + CROSS_PX), WHITE)


def _said(track: Track) -> str:
    """Whose and what it is, its own kind first."""
    probabilities = track.kind_probabilities.model_dump()
    kinds = sorted(probabilities, key=lambda kind: (kind != track.kind, -probabilities[kind]))
    said = [
        f"{SHORT[kind]} {probabilities[kind]:.2f}" for kind in kinds if probabilities[kind] >= LEAST_SAID or kind == track.kind
    ]
    whose = "?" if track.person_id is None else str(track.person_id)
    return f"{whose}: {', '.join(said)}"


def _done_by(person: TruePerson) -> str:
    """What the truth says that a person does."""
    phase = person.nonpoint_phase if person.nonpoint_phase not in (None, "none") else person.phase
    if phase == "none":
        return f"truth: person {person.id}, yaw {person.head.yaw_rel_deg:+.0f}"
    target = f" at {person.poi}" if person.poi is not None else ""
    return f"truth: person {person.id}, {person.gesture}{target}: {phase}, yaw {person.head.yaw_rel_deg:+.0f}"


def _write_all(image: Picture, labels: Sequence[Label]) -> None:
    """Write labels above what they say something of; below where that is out of the picture, and never upon each other."""
    taken: list[Rectangle] = []
    for label in sorted(labels, key=lambda label: label.at[1]):
        width = cv2.getTextSize(label.text, FONT, LETTERS, 1)[0][0]
        x = max(2, min(label.at[0], image.shape[1] - width - 2))
        y = label.at[1] - 5 if label.at[1] > LINE_PX else label.at[1] + label.at[3] + LINE_PX
        while any(_overlap((x, y - LINE_PX, width, LINE_PX), other) for other in taken):
            y += LINE_PX
        taken.append((x, y - LINE_PX, width, LINE_PX))
        _write(image, label.text, (x, y), label.colour)


def _write(image: Picture, text: str, at: tuple[int, int], colour: Colour) -> None:
    """Words that can be read on any ground."""
    cv2.putText(image, text, at, FONT, LETTERS, BLACK, 3, cv2.LINE_AA)
    cv2.putText(image, text, at, FONT, LETTERS, colour, 1, cv2.LINE_AA)


def _overlap(one: Rectangle, other: Rectangle) -> bool:
    across = one[0] < other[0] + other[2] and other[0] < one[0] + one[2]
    return across and one[1] < other[1] + other[3] and other[1] < one[1] + one[3]


def _dashed(image: Picture, at: Rectangle, colour: Colour) -> None:
    x, y, w, h = at
    for k in range(0, w, 2 * DASH_PX):
        end = min(x + k + DASH_PX, x + w)
        for row in (y, y + h):
            cv2.line(image, (x + k, row), (end, row), colour, 1)
    for k in range(0, h, 2 * DASH_PX):
        end = min(y + k + DASH_PX, y + h)
        for column in (x, x + w):
            cv2.line(image, (column, y + k), (column, end), colour, 1)


def _scaled(box: tuple[float, float, float, float], scale: int) -> Rectangle:
    x, y, w, h = (round(value * scale) for value in box)
    return x, y, w, h
