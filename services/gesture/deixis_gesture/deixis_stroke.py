"""Whether a stroke points, as a probability: `pointing_odds.py` over its frames."""

from __future__ import annotations

import math
import statistics
from collections import Counter, deque
from typing import NamedTuple

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


class _Seen(NamedTuple):
    """One frame: its log odds, and the side it shows."""

    look: Look
    odds: float
    side: PointingKind


class DeixisStroke:
    """One stroke."""

    def __init__(self, config: GestureConfig) -> None:
        self._config = config
        self._recent: deque[_Seen] = deque(maxlen=256)
        self._began_s: float | None = None
        self._gesture: GestureKind = "none"

    def add(self, look: Look) -> Verdict:
        """Take one more frame."""
        self._began_s = look.time_s if self._began_s is None else self._began_s
        self._recent.append(_seen(look))
        while look.time_s - self._recent[0].look.time_s > RECENT_S:
            self._recent.popleft()
        measures = self._measures(lasting_s := look.time_s - self._began_s)
        parts = stroke_odds().parts(measures)
        probability = 1 / (1 + math.exp(-(stroke_odds().constant + math.fsum(parts.values()))))
        if lasting_s >= self._config.settle_s:
            self._gesture = self._decided(probability)
        return Verdict(self._gesture, probability, measures, parts)

    def _decided(self, probability: float) -> GestureKind:
        points = self._gesture not in ("none", "other")
        if probability < (self._config.doubted if points else self._config.believed):
            return "other"
        kind = self._kind()
        # A hand without a finger that was up already when the person came may rest there.
        return "other" if kind == "invisible" and not self._recent[-1].look.may_be_invisible else kind

    def _kind(self) -> PointingKind:
        votes = Counter(seen.side for seen in self._recent)
        directed: PointingKind = "point_left" if votes["point_left"] >= votes["point_right"] else "point_right"
        return directed if votes[directed] >= DIRECTED_SHARE * len(self._recent) else "invisible"

    def _measures(self, lasting_s: float) -> Measures:
        """What is weighed of the stroke so far."""
        posture = statistics.fmean(seen.odds for seen in self._recent)
        return stroke_measures(posture, lasting_s, self._shaking(), self._recent[-1].look.way)

    def _shaking(self) -> float:
        """Spread of the palm's place."""
        xs, ys = ([seen.look.held.palm[axis] for seen in self._recent] for axis in (0, 1))
        return math.hypot(statistics.pstdev(xs), statistics.pstdev(ys))


def _seen(look: Look) -> _Seen:
    odds = frame_odds()
    told = odds.constant + math.fsum(odds.parts(frame_measures(look.held)).values())
    # A pointing is made with one hand, whatever each of two that are held up together looks like (signers, claps); and a palm
    # that is shown says "stop", also where few of the hands that the tables were fitted on were held there.
    points_not = look.joined or look.held.is_open_palm
    bounded = -MOST_FRAME_ODDS if points_not else min(max(told, -MOST_FRAME_ODDS), MOST_FRAME_ODDS)
    return _Seen(look, bounded, pointing_side(look.hand, look.fingers))
