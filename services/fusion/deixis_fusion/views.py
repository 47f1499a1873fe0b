"""A stroke as seen from several places: somebody who walks and points sees what is meant at ever other bearings.

Bearings are rays in the map (`Sample.turn_to`), so a camera that moves around a person who stands changes nothing. Where the
person moves as well, the stroke is cut into parts in each of which the person hardly moved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from .evidence import HandObservation, HeadObservation, Sample, View, Weighed
from .hand_evidence import hand_over
from .head_evidence import head_over
from .localisation import PersonPlace

# So far a POI that is 2 m off moves by 7 degrees, about what a pointing arm tells.
APART_M = 0.25
MOST_VIEWS = 8


def last_place(samples: Sequence[Sample]) -> PersonPlace | None:
    """Where the person stood last, of these frames; none where that was never known."""
    return next((sample.place for sample in reversed(samples) if sample.place is not None), None)


def views_of(weighed: Weighed, hand: HandObservation | None, head: HeadObservation | None) -> tuple[View, ...]:
    """The parts of a stroke of which hand and head are known as a whole; none where it was seen from one place."""
    apart_m, parts = APART_M, _parts(weighed, APART_M)
    while len(parts) > MOST_VIEWS:
        apart_m *= 1.5
        parts = _parts(weighed, apart_m)
    if len(parts) < 2:
        return ()
    return tuple(_shared([_view(part, hand, head) for part in parts], parts))


def _parts(weighed: Weighed, apart_m: float) -> list[Weighed]:
    """Consecutive frames while the person is within `apart_m` of where the first of them was."""
    parts: list[list[tuple[Sample, float]]] = []
    began: PersonPlace | None = None
    for sample, weight in weighed:
        if sample.place is None:
            continue
        if began is None or math.dist(began.position_m[:2], sample.place.position_m[:2]) > apart_m:
            began = sample.place
            parts.append([])
        parts[-1].append((sample, weight))
    return list(parts)


def _view(part: Weighed, hand: HandObservation | None, head: HeadObservation | None) -> View:
    """What a part shows; the gesture, and how far all agree, is that of the whole stroke."""
    place = last_place([sample for sample, _ in part])
    axis_deg = place.axis_deg if place is not None else None
    of_hand = hand_over(part, axis_deg) if hand is not None else None
    of_head = head_over(part, axis_deg) if head is not None else None
    if hand is not None and of_hand is not None:
        of_hand = replace(of_hand, gesture=hand.gesture, agreement=hand.agreement)
    if head is not None and of_head is not None:
        of_head = replace(of_head, agreement=head.agreement)
    return View(of_hand, of_head, place)


def _shared(views: Sequence[View], parts: Sequence[Weighed]) -> list[View]:
    """The views with their shares: by the frames of each part that shows the hand, or the head."""
    hands = [_total(part) if view.hand is not None else 0.0 for view, part in zip(views, parts, strict=True)]
    heads = [_total(part) if view.head is not None else 0.0 for view, part in zip(views, parts, strict=True)]
    return [
        view._replace(hand_share=of_hand / max(sum(hands), 1e-9), head_share=of_head / max(sum(heads), 1e-9))
        for view, of_hand, of_head in zip(views, hands, heads, strict=True)
    ]


def _total(part: Weighed) -> float:
    return math.fsum(weight for _, weight in part)
