"""What hand and head showed over the frames of a stroke, or of a part of it."""

from __future__ import annotations

from typing import NamedTuple

from .evidence import ROW, HandObservation, HeadObservation
from .frames import Frames
from .hand_evidence import HandFrames
from .head_evidence import HeadFrames
from .robust import middles_of

_MEASURED = slice(ROW["bearing_deg"], ROW["pitch_sigma_deg"] + 1)
_OF_EACH = 4


class Shown(NamedTuple):
    """A pointing hand, none without a pointing frame; and a head, none where it was tracked in too few frames to tell."""

    hand: HandObservation | None
    head: HeadObservation | None


def shown_over(frames: Frames, axis_deg: float | None = None, with_curve: bool = True) -> Shown:
    """What these frames show together; on request without the likelihood of bearings.

    Angles are from the direction `axis_deg` in the map, whichever way the camera was when each was seen; without it, from the
    direction to the camera in each frame.
    """
    totals, turns = frames.totals(), frames.turns_to(axis_deg)
    measured = frames.table[_MEASURED].copy()
    hand = HandFrames(frames, totals, measured[:_OF_EACH], turns)
    head = HeadFrames(frames, totals, measured[_OF_EACH:], turns)
    # Both at once: of so few frames a call of numpy takes as long as what it does.
    of_hand, of_head = middles_of(measured, frames.early)
    return Shown(hand.observed(of_hand, with_curve), head.observed(of_head))
