"""One hand over time: whether it rests, comes up, is held still, or goes. Pure."""

from __future__ import annotations

import math
from collections import Counter, deque

from deixis_schemas.messages import GestureKind, Phase

from .config import GestureConfig
from .fingers import HandRead, shape_of

Place = tuple[float, float]

UNSURE, SHOWN = 0.25, 3
"""Index fingers among the looks of a stroke, by those and other shapes, and looks at least, that make it a pointing: of a hand
some twenty pixels wide the model is often unsure."""
HELD_OUT = 2.0
"""A hand whose fingers nobody can read is held out where it is so far beside the face, face widths."""


class Hand:
    """One hand. Places are face widths from the middle of the face, x toward image right, y down."""

    def __init__(self, track_id: int, config: GestureConfig) -> None:
        self.track_id = track_id
        self.phase: Phase = "idle"
        self.place: Place = (0.0, 0.0)
        self.seen_s = -math.inf
        self.read: HandRead | None = None
        self._config = config
        self._way: deque[tuple[float, Place]] = deque(maxlen=64)
        self._still_since_s: float | None = None
        self._shapes: Counter[str] = Counter()

    @property
    def is_raised(self) -> bool:
        """Whether it is up, or off the body."""
        x, y = self.place
        beside = abs(x) >= self._config.beside_body
        return y <= (self._config.raised_beside_below_face if beside else self._config.raised_below_face)

    def follow(self, place: Place, now_s: float) -> None:
        """The hand is seen there now. It is still if it is beside its own face, whatever the camera does."""
        self.place, self.seen_s = place, now_s
        self._way.append((now_s, place))
        while now_s - self._way[0][0] > self._config.speed_window_s and len(self._way) > 2:
            self._way.popleft()
        self._step(now_s)

    def look(self, read: HandRead | None) -> None:
        """What its fingers show in this frame; none where they could not be read."""
        self.read = read
        if self.phase == "stroke":
            self._shapes["unseen" if read is None else shape_of(read)] += 1

    @property
    def gesture(self) -> GestureKind:
        """What the stroke shows so far."""
        if self.phase != "stroke":
            return "none"
        index, other, fist = (self._shapes[name] for name in ("index", "other", "fist"))
        if index >= SHOWN and index >= UNSURE * (index + other + fist):
            return "point_left" if self._aside > 0 else "point_right"
        if other > max(fist, index):
            return "other"
        read = index + other + fist
        if abs(self.place[0]) >= HELD_OUT and (read == 0 or fist > 0):
            return "invisible"
        return "other" if read else "none"

    @property
    def _aside(self) -> float:
        """To which side it points: where it is, or near the middle of the body where the finger goes."""
        if abs(self.place[0]) >= 1 or self.read is None:
            return self.place[0]
        return float(self.read.points[8, 0] - self.read.points[5, 0])

    def _speed(self) -> float:
        (begin_s, begin), (end_s, end) = self._way[0], self._way[-1]
        return math.dist(begin, end) / (end_s - begin_s) if end_s > begin_s else math.inf

    def _step(self, now_s: float) -> None:
        speed = self._speed()
        if not self.is_raised:
            self.phase, self._still_since_s = "idle", None
        elif self.phase == "stroke":
            if speed > self._config.moving_speed:
                self.phase, self._still_since_s = "retraction", None
        elif speed > self._config.still_speed:
            self.phase = "retraction" if self.phase == "retraction" else "preparation"
            self._still_since_s = None
        else:
            self._still_since_s = now_s if self._still_since_s is None else self._still_since_s
            if self.phase == "idle":
                self.phase = "preparation"
            if now_s - self._still_since_s >= self._config.settle_s:
                self.phase, self._shapes = "stroke", Counter()
