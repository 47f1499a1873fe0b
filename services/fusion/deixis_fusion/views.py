"""A stroke as seen from several places: somebody who walks and points sees what is meant at ever other bearings.

Bearings are rays in the map (`Sample.turn_to`), so a camera that moves around a person who stands changes nothing. Where the
person moves as well, the stroke is cut into parts in each of which the person hardly moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from .evidence import HandObservation, HeadObservation, Sample, View
from .frames import Frames
from .hand_evidence import hand_over
from .head_evidence import head_over
from .localisation import PersonPlace
from .pointing import PointingGesture

# So far a POI that is 2 m off moves by 7 degrees, about what a pointing arm tells.
APART_M = 0.25
MOST_VIEWS = 8


def last_place(samples: Sequence[Sample]) -> PersonPlace | None:
    """Where the person stood last, of these frames; none where that was never known."""
    return next((sample.place for sample in reversed(samples) if sample.place is not None), None)


def parts_of(frames: Frames) -> list[Frames]:
    """The parts of a stroke, in each of which the person hardly moved; none where it was seen from one place."""
    placed, apart_m = frames.placed(), APART_M
    x, y = placed.column("x_m"), placed.column("y_m")
    if not len(placed) or np.hypot(x - x[0], y - y[0]).max() <= apart_m:
        return []
    spots = list(zip(x.tolist(), y.tolist(), strict=True))
    while len(starts := _starts(spots, apart_m)) > MOST_VIEWS:
        apart_m *= 1.5
    if len(starts) < 2:
        return []
    return [placed[start:stop] for start, stop in pairwise([*starts, len(placed)])]


def views_of(parts: Sequence[Frames], hand: HandObservation | None, head: HeadObservation | None) -> tuple[View, ...]:
    """What these parts of a stroke show, of which hand and head are known as a whole."""
    return tuple(_shared([_view(part, hand, head) for part in parts], parts))


def _starts(spots: Sequence[tuple[float, float]], apart_m: float) -> list[int]:
    """Where parts of consecutive frames begin, in each of which the person is within `apart_m` of where its first was.

    No more than there may be views, and one.
    """
    starts: list[int] = []
    began_x, began_y = 0.0, 0.0
    for i, (x, y) in enumerate(spots):
        if starts and (x - began_x) * (x - began_x) + (y - began_y) * (y - began_y) <= apart_m * apart_m:
            continue
        starts.append(i)
        began_x, began_y = x, y
        if len(starts) > MOST_VIEWS:
            break
    return starts


def _view(part: Frames, hand: HandObservation | None, head: HeadObservation | None) -> View:
    """What a part shows; the gesture is that of the whole stroke, and how far its frames agree is told there alone."""
    seen = _shown(tuple(part.samples), tuple(part.weights.tolist()), hand.gesture if hand else None)
    return seen if head is not None else seen._replace(head=None)


# Of a walk only the last part changes from frame to frame.
@lru_cache(maxsize=8 * MOST_VIEWS)
def _shown(samples: tuple[Sample, ...], weights: tuple[float, ...], gesture: PointingGesture | None) -> View:
    frames, place = Frames.of(samples, np.array(weights)), last_place(samples)
    axis_deg = place.axis_deg if place is not None else None
    hand, head = hand_over(frames, axis_deg) if gesture else None, head_over(frames, axis_deg)
    return View(
        replace(hand, gesture=gesture, agreement=1.0) if hand and gesture else None,
        replace(head, agreement=1.0) if head else None,
        place,
    )


def _shared(views: Sequence[View], parts: Sequence[Frames]) -> list[View]:
    """The views with their shares: by the frames of each part that shows the hand, or the head."""
    totals = [float(part.weights.sum()) for part in parts]
    hands = [total if view.hand is not None else 0.0 for view, total in zip(views, totals, strict=True)]
    heads = [total if view.head is not None else 0.0 for view, total in zip(views, totals, strict=True)]
    return [
        view._replace(hand_share=of_hand / max(sum(hands), 1e-9), head_share=of_head / max(sum(heads), 1e-9))
        for view, of_hand, of_head in zip(views, hands, heads, strict=True)
    ]
