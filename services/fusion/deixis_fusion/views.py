"""A stroke as seen from several places: somebody who walks and points sees what is meant at ever other bearings.

Bearings are rays in the map (`Sample.turn_to`), so a camera that moves around a person who stands changes nothing. Where the
person moves as well, the stroke is cut into parts in each of which the person hardly moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

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
    spots = x + 1j * y
    while len(starts := _starts(spots, apart_m)) > MOST_VIEWS:
        apart_m *= 1.5
    if len(starts) < 2:
        return []
    return [placed[start:stop] for start, stop in pairwise([*starts, len(placed)])]


def views_of(parts: Sequence[Frames], hand: HandObservation | None, head: HeadObservation | None) -> tuple[View, ...]:
    """What these parts of a stroke show, of which hand and head are known as a whole."""
    known = [_Part.of(frames) for frames in parts]
    return tuple(_shared([_view(part, hand, head) for part in known], known))


def _starts(spots: npt.NDArray[np.complex128], apart_m: float) -> list[int]:
    """Where parts of consecutive frames begin, in each of which the person is within `apart_m` of where its first was.

    `spots` are the person's places (n). No more than there may be views, and one.
    """
    starts = [0]
    while len(starts) <= MOST_VIEWS:
        far = np.abs(spots[starts[-1] :] - spots[starts[-1]]) > apart_m
        next_one = int(far.argmax())
        if not far[next_one]:
            break
        starts.append(starts[-1] + next_one)
    return starts


@dataclass(frozen=True)
class _Part:
    """A part of a stroke, known by its ends and by how much its frames count together: of all others it has the same."""

    first: Sample
    last: Sample
    count: int
    weight: float
    frames: Frames = field(compare=False)

    @staticmethod
    def of(frames: Frames) -> _Part:
        """Of these frames, one at least."""
        return _Part(frames.samples[0], frames.samples[-1], len(frames), float(frames.weights.sum()), frames)


def _view(part: _Part, hand: HandObservation | None, head: HeadObservation | None) -> View:
    """What a part shows; the gesture is that of the whole stroke, and how far its frames agree is told there alone."""
    seen = _shown(part, hand.gesture if hand else None)
    return seen if head is not None else seen._replace(head=None)


# Of a walk only the last part changes from frame to frame.
@lru_cache(maxsize=8 * MOST_VIEWS)
def _shown(part: _Part, gesture: PointingGesture | None) -> View:
    place = last_place(part.frames.samples)
    axis_deg = place.axis_deg if place is not None else None
    hand, head = hand_over(part.frames, axis_deg) if gesture else None, head_over(part.frames, axis_deg)
    return View(
        replace(hand, gesture=gesture, agreement=1.0) if hand and gesture else None,
        replace(head, agreement=1.0) if head is not None else None,
        place,
    )


def _shared(views: Sequence[View], parts: Sequence[_Part]) -> list[View]:
    """The views with their shares: by the frames of each part that shows the hand, or the head."""
    hands = [part.weight if view.hand is not None else 0.0 for view, part in zip(views, parts, strict=True)]
    heads = [part.weight if view.head is not None else 0.0 for view, part in zip(views, parts, strict=True)]
    of_hands, of_heads = max(sum(hands), 1e-9), max(sum(heads), 1e-9)
    return [
        view._replace(hand_share=of_hand / of_hands, head_share=of_head / of_heads)
        for view, of_hand, of_head in zip(views, hands, heads, strict=True)
    ]
