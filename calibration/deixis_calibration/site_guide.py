"""The guided part: who is asked to point at what, and when a pointing has been held long enough. No transport, no clock."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from deixis_fusion.pointing import GESTURES
from deixis_schemas.messages import Gestures

HELD_S = 1.0
WAIT_S = 15.0
GAP_S = 0.4
"""A stroke that drops out for less goes on."""
State = Literal["waiting", "pointing", "held", "given up"]


@dataclass(frozen=True)
class Asked:
    """One pointing to ask for; first_at_spot: the person has to walk there before."""

    number: int
    spot: str
    poi_id: str
    first_at_spot: bool


def plan(spots: Sequence[str], poi_ids: Sequence[str], rounds: int) -> Iterator[Asked]:
    """All rounds at a spot before the next: walking takes longest. Every other round goes backwards."""
    number = 0
    for spot in spots:
        for turn in range(rounds):
            order = poi_ids if turn % 2 == 0 else poi_ids[::-1]
            for place, poi_id in enumerate(order):
                yield Asked(number, spot, poi_id, first_at_spot=turn == 0 and place == 0)
                number += 1


def somebody_points(gestures: Gestures) -> bool:
    """Whether anybody's stroke is a pointing in this frame."""
    return any(gesture.phase == "stroke" and gesture.gesture in GESTURES for gesture in gestures.gestures)


class HoldWatch:
    """Waits for a pointing that is held. Times are those of the frames, nanoseconds."""

    def __init__(self) -> None:
        self._began_ns: int | None = None
        self._first_ns: int | None = None
        self._last_ns = 0

    def hear(self, gestures: Gestures) -> State:
        """Take in the gestures of the next frame."""
        now_ns = gestures.stamp_ns
        self._began_ns = now_ns if self._began_ns is None else self._began_ns
        if somebody_points(gestures):
            self._first_ns = now_ns if self._first_ns is None else self._first_ns
            self._last_ns = now_ns
        elif self._first_ns is not None and now_ns - self._last_ns > GAP_S * 1e9:
            self._first_ns = None
        if self._first_ns is not None:
            return "held" if self._last_ns - self._first_ns >= HELD_S * 1e9 else "pointing"
        return "given up" if now_ns - self._began_ns > WAIT_S * 1e9 else "waiting"

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last frame of the pointing; of one that was given up, of all that was waited."""
        began_ns = self._began_ns or 0
        return (began_ns, began_ns + round(WAIT_S * 1e9)) if self._first_ns is None else (self._first_ns, self._last_ns)
