"""The gesture of a stroke by the votes of its frames (`rules.py`; paper section 4): `rules: paper`.

It is decided when the stroke has settled and then kept, unless the recent votes say clearly otherwise.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from deixis_schemas.messages import GestureKind

from .rules import Vote, vote
from .stroke import Look, Verdict

RECENT_S = 0.5
OPEN_SHARE = 0.3
FINGER_SHARE = 0.25
INVISIBLE_SHARE = 0.6
CHANGE_SHARE = 0.75
# A finger that comes out of the blur makes "invisible" more precise; it does not contradict it.
REFINE_SHARE = 0.5


class PaperStroke:
    """The gesture of one stroke, from the votes of its frames."""

    def __init__(self, settle_s: float) -> None:
        self._settle_s = settle_s
        self._votes: deque[tuple[float, Vote]] = deque(maxlen=256)
        self._began_s: float | None = None
        self._gesture: GestureKind = "none"

    def add(self, look: Look) -> Verdict:
        """Count the vote of one more frame."""
        seen: Vote = "other" if look.joined else vote(look.hand, look.fingers)
        self.count(look.time_s, seen, look.may_be_invisible)
        return Verdict(self._gesture)

    def count(self, time_s: float, seen: Vote, may_be_invisible: bool) -> GestureKind:
        """Count a vote; `may_be_invisible`: the hand's history allows a pointing without a visible finger."""
        if self._began_s is None:
            self._began_s = time_s
        if seen == "invisible" and not may_be_invisible:
            seen = "unclear"
        self._votes.append((time_s, seen))
        if time_s - self._began_s < self._settle_s:
            return self._gesture
        recent = [v for t, v in self._votes if self._gesture == "none" or time_s - t <= RECENT_S]
        winner, share = _winner(recent)
        refined = self._gesture == "invisible" and winner in ("point_left", "point_right")
        enough = REFINE_SHARE if refined else CHANGE_SHARE
        if self._gesture == "none" or (share >= enough and time_s - self._began_s >= RECENT_S):
            self._gesture = winner
        return self._gesture


def _winner(votes: Sequence[Vote]) -> tuple[GestureKind, float]:
    """The gesture of some votes and its share. An open hand needs few votes: a false pointing costs most."""
    share = {kind: votes.count(kind) / len(votes) for kind in ("point_left", "point_right", "invisible", "other")}
    if share["other"] >= OPEN_SHARE:
        return "other", share["other"]
    directed: GestureKind = "point_left" if share["point_left"] >= share["point_right"] else "point_right"
    if share[directed] >= FINGER_SHARE:
        return directed, share[directed]
    if share["invisible"] >= INVISIBLE_SHARE:
        return "invisible", share["invisible"]
    return "other", 0.0
