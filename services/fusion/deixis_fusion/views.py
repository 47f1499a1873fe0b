"""A stroke as seen from several places: somebody who walks and points sees what is meant at ever other bearings.

Bearings are rays in the map (`Sample.turn_to`), so a camera that moves around a person who stands changes nothing. Where the
person moves as well, the stroke is cut into parts in each of which the person hardly moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from .evidence import HandObservation, HeadObservation, Sample, View
from .frames import Frames
from .localisation import PersonPlace
from .pointing import PointingGesture
from .shown import shown_over


def last_place(samples: Sequence[Sample]) -> PersonPlace | None:
    """Where the person stood last, of these frames; none where that was never known."""
    return next((sample.place for sample in reversed(samples) if sample.place is not None), None)


class Part(NamedTuple):
    """Frames `start` to `stop` of those that are known with their places."""

    placed: Frames
    start: int
    stop: int

    @property
    def weight(self) -> float:
        """How much its frames count together."""
        return self.placed.weight_of(self.start, self.stop)


def parts_of(frames: Frames) -> list[Part]:
    """The parts of a stroke, in each of which the person hardly moved; none where it was seen from one place."""
    placed = frames.placed()
    starts = placed.log.walk.starts
    if len(starts) < 2:
        return []
    return [Part(placed, start, stop) for start, stop in pairwise([*starts, len(placed)])]


def views_of(parts: Sequence[Part], hand: HandObservation | None, head: HeadObservation | None) -> tuple[View, ...]:
    """What these parts of a stroke show, of which hand and head are known as a whole."""
    gesture = hand.gesture if hand else None
    return tuple(_shared([_view(part, gesture, head is not None) for part in parts], parts))


def _view(part: Part, gesture: PointingGesture | None, with_head: bool) -> View:
    """What a part shows; the gesture is that of the whole stroke, and how far its frames agree is told there alone."""
    log, key = part.placed.log, (part.start, part.stop, gesture)
    # Of a walk only the last part changes from frame to frame.
    seen = log.shown.get(key)
    if seen is None:
        seen = _shown(part.placed[part.start : part.stop], gesture)
        if part.stop < len(log):
            log.shown[key] = seen
    return seen if with_head else seen._replace(head=None)


def _shown(frames: Frames, gesture: PointingGesture | None) -> View:
    place = frames.log[frames.stop - 1].place
    hand, head = shown_over(frames, place.axis_deg if place is not None else None)
    return View(
        replace(hand, gesture=gesture, agreement=1.0) if hand and gesture else None,
        replace(head, agreement=1.0) if head is not None else None,
        place,
    )


def _shared(views: Sequence[View], parts: Sequence[Part]) -> list[View]:
    """The views with their shares: by the frames of each part that shows the hand, or the head."""
    weights = [part.weight for part in parts]
    hands = [weight if view.hand is not None else 0.0 for view, weight in zip(views, weights, strict=True)]
    heads = [weight if view.head is not None else 0.0 for view, weight in zip(views, weights, strict=True)]
    of_hands, of_heads = max(sum(hands), 1e-9), max(sum(heads), 1e-9)
    return [
        View(view.hand, view.head, view.place, of_hand / of_hands, of_head / of_heads)
        for view, of_hand, of_head in zip(views, hands, heads, strict=True)
    ]
