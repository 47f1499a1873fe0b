"""Whether a stroke points, as a probability: `pointing_odds.py` over its frames."""

from __future__ import annotations

import math
import statistics
from collections import Counter, deque

from deixis_schemas.messages import GestureKind

from .config import GestureConfig
from .pointing_odds import Measures, frame_measures, frame_odds, stroke_measures, stroke_odds
from .pointing_side import PointingKind, pointing_side
from .stroke import Look, Verdict

RECENT_S = 0.5
"""Only so much of a stroke counts at a time: a hand can open, or begin to wave."""
MOST_FRAME_ODDS = 8.0
"""Frames of one stroke show nearly the same; none of them shall outweigh the others."""
DIRECTED_SHARE = 0.3
"""A finger or side seen in this part of the frames is seen: at VGA it comes and goes with the outline."""


class DeixisStroke:
    """One stroke."""

    def __init__(self, config: GestureConfig) -> None:
        self._config = config
        self._looks: deque[tuple[Look, float, PointingKind]] = deque(maxlen=256)
        self._began_s: float | None = None
        self._gesture: GestureKind = "none"

    def add(self, look: Look) -> Verdict:
        """Take one more frame."""
        self._began_s = look.time_s if self._began_s is None else self._began_s
        odds = frame_odds()
        told = odds.constant + math.fsum(odds.parts(frame_measures(look.held)).values())
        # A pointing is made with one hand, whatever each of two that are held up together looks like: signers, claps.
        bounded = -MOST_FRAME_ODDS if look.joined else min(max(told, -MOST_FRAME_ODDS), MOST_FRAME_ODDS)
        self._looks.append((look, bounded, pointing_side(look.hand, look.fingers)))
        while look.time_s - self._looks[0][0].time_s > RECENT_S:
            self._looks.popleft()
        return self._verdict(look.time_s - self._began_s)

    def _verdict(self, lasting_s: float) -> Verdict:
        odds = stroke_odds()
        measures = self._measures(lasting_s)
        parts = odds.parts(measures)
        probability = 1 / (1 + math.exp(-(odds.constant + math.fsum(parts.values()))))
        if lasting_s >= self._config.settle_s:
            limit = self._config.doubted if self._gesture not in ("none", "other") else self._config.believed
            self._gesture = self._kind() if probability >= limit else "other"
        return Verdict(self._gesture, probability, measures, parts)

    def _measures(self, lasting_s: float) -> Measures:
        """What is weighed of the stroke so far."""
        latest = self._looks[-1][0]
        posture = statistics.fmean(odds for _, odds, _ in self._looks)
        return stroke_measures(posture, lasting_s, self._shaking(), latest.way, not latest.may_be_invisible)

    def _kind(self) -> PointingKind:
        votes = Counter(kind for _, _, kind in self._looks)
        directed: PointingKind = "point_left" if votes["point_left"] >= votes["point_right"] else "point_right"
        return directed if votes[directed] >= DIRECTED_SHARE * len(self._looks) else "invisible"

    def _shaking(self) -> float:
        """Spread of the palm's place."""
        xs, ys = ([look.held.palm[axis] for look, _, _ in self._looks] for axis in (0, 1))
        return math.hypot(statistics.pstdev(xs), statistics.pstdev(ys))
