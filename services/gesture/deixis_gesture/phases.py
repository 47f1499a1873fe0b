"""Phases of a gesture from the motion of the hand: preparation, stroke, retraction (paper section 4, [13]).

A stroke is a raised hand that is nearly motionless; preparation leads up to it and retraction back to rest. Speeds are in
face widths per second and measured over time, not frames, so that neither distance nor rate nor dropped frames matter.
"""

from __future__ import annotations

import math
import statistics
from collections import deque
from dataclasses import dataclass
from itertools import combinations

from deixis_schemas.messages import Phase

from .config import GestureConfig

# Slope between two samples closer than this is mostly noise.
LEAST_SPAN_S = 0.02
# Speeds that tell a hand on its way from a hand at rest, face widths per second: away from rest (up, or sideways off the body,
# as an arm swings out before it rises), back to rest, and up again out of a retraction.
LEAVING_SPEED = 0.7
RESTING_SPEED = 0.7
RAISING_AGAIN_SPEED = 2.0
# A hand is under way when it is this far from where it rested, face widths; outlines at rest flicker by less.
LEAVING_DISTANCE = 0.15
# A hand that is held is still while it stays this near to where it is held, face widths: its outline is cut now here, now there
# from the arm and jumps by 0.3, by which strokes broke off five times a second. Chosen among 0.35, 0.5 and 0.65 by
# `deixis eval --stage gesture --seeds 1000:1040`.
HELD_WITHIN = 0.5
HELD_TIME_S = 0.2
REST_TIME_S = 0.5
KEEP_SAMPLES = 64


class Motion:
    """Velocity of a point by the median of its slopes (Theil-Sen), which one stray sample does not move."""

    def __init__(self, window_s: float) -> None:
        self._window_s = window_s
        self._samples: deque[tuple[float, float, float]] = deque(maxlen=KEEP_SAMPLES)

    def add(self, time_s: float, point: tuple[float, float]) -> None:
        """A sample; times must rise. Older samples leave the window, but one before it stays for slow cameras."""
        self._samples.append((time_s, *point))
        while len(self._samples) > 2 and time_s - self._samples[1][0] >= self._window_s:
            self._samples.popleft()

    @property
    def velocity(self) -> tuple[float, float] | None:
        """(vx, vy) per second, y down; None before there are two samples."""
        slopes = [
            ((b[1] - a[1]) / (b[0] - a[0]), (b[2] - a[2]) / (b[0] - a[0]))
            for a, b in combinations(self._samples, 2)
            if b[0] - a[0] >= LEAST_SPAN_S
        ]
        if not slopes:
            return None
        return statistics.median(s[0] for s in slopes), statistics.median(s[1] for s in slopes)


@dataclass(frozen=True)
class Way:
    """How a hand came from where it rested: how long that took, and how far up and aside it went about the face."""

    seconds: float
    up: float
    aside: float


class PhaseTracker:
    """Phase of one hand."""

    def __init__(self, config: GestureConfig) -> None:
        self._config = config
        self._motion = Motion(config.speed_window_s)
        self.phase: Phase = "idle"
        self.rose = False
        self.raised = False
        self._rest: tuple[float, float] | None = None
        self._held: tuple[float, float] | None = None
        self._last_s = 0.0
        self._departure: tuple[float, tuple[float, float]] | None = None
        self.way: Way | None = None

    def update(self, time_s: float, point: tuple[float, float], place: tuple[float, float], walking: bool) -> Phase:
        """Advance to `time_s`: hand at `point` (face widths, fixed to the room), at `place` about the face's centre."""
        self._motion.add(time_s, point)
        velocity = self._motion.velocity
        if velocity is not None:
            self.raised = self._is_raised(place)
            outward = velocity[0] if place[0] > 0 else -velocity[0]
            leaving = max(-velocity[1], outward) if self._has_left_rest(point) else 0.0
            before = self.phase
            at_hold = self._held is not None and math.dist(self._held, point) < HELD_WITHIN
            self.phase = "idle" if walking and self.phase != "stroke" else self._following(*velocity, leaving, at_hold)
            self._follow_way(time_s, place, before)
            self.rose = self.phase == "preparation" or (self.rose and self.phase != "idle")
        self._held = _nearer(self._held or point, point, time_s - self._last_s, HELD_TIME_S) if self.phase == "stroke" else None
        self._follow_rest(time_s, point)
        return self.phase

    def _follow_way(self, time_s: float, place: tuple[float, float], before: Phase) -> None:
        """Remember where the hand rested last; when it stands, how it came from there."""
        if self.phase == "idle":
            self._departure = time_s, place
        elif self.phase == "stroke" and before != "stroke":
            self.way = self._way_to(time_s, place)

    def _way_to(self, time_s: float, place: tuple[float, float]) -> Way | None:
        if self._departure is None:
            return None
        began_s, rest = self._departure
        return Way(time_s - began_s, rest[1] - place[1], abs(place[0]) - abs(rest[0]))

    def _has_left_rest(self, point: tuple[float, float]) -> bool:
        return self._rest is None or math.dist(self._rest, point) >= LEAVING_DISTANCE

    def _follow_rest(self, time_s: float, point: tuple[float, float]) -> None:
        """Where the idle hand is, slowly: breathing and a shifting outline are not under way."""
        passed_s, self._last_s = time_s - self._last_s, time_s
        if self._rest is None or self.phase != "idle":
            self._rest = point
            return
        self._rest = _nearer(self._rest, point, passed_s, REST_TIME_S)

    def _is_raised(self, place: tuple[float, float]) -> bool:
        """Higher than a resting hand; once raised a hand may sink a little before it counts as lowered."""
        slack = 0.25 if self.raised else 0.0
        beside = abs(place[0]) >= self._config.beside_body - slack
        limit = self._config.raised_beside_below_face if beside else self._config.raised_below_face
        return place[1] <= limit + slack or self._has_come_up(place, slack)

    def _has_come_up(self, place: tuple[float, float], slack: float) -> bool:
        """From where it rested, though not as high as others: one pointing in seven, from the hip or to something low."""
        if self._departure is None or place[1] > self._config.lowest_raised + slack:
            return False
        return self._departure[1][1] - place[1] >= self._config.raised_from_rest - slack

    def _following(self, vx: float, vy: float, leaving: float, at_hold: bool) -> Phase:
        speed = math.hypot(vx, vy)
        still = at_hold or speed < (self._config.moving_speed if self.phase == "stroke" else self._config.still_speed)
        if self.raised and still:
            return "stroke"
        if self.phase in ("stroke", "retraction"):
            if -vy > RAISING_AGAIN_SPEED:
                return "preparation"
            return "idle" if not self.raised and speed < RESTING_SPEED else "retraction"
        if self.phase == "preparation":
            return self._after_preparation(vy, speed)
        return "preparation" if self.raised or leaving > LEAVING_SPEED else "idle"

    def _after_preparation(self, vy: float, speed: float) -> Phase:
        if not self.raised and speed < RESTING_SPEED:
            return "idle"
        return "retraction" if vy > LEAVING_SPEED and not self.raised else "preparation"


def _nearer(
    place: tuple[float, float], point: tuple[float, float], passed_s: float, time_constant_s: float
) -> tuple[float, float]:
    """`place` moved toward `point`, by what is left of the way after so long."""
    share = 1 - math.exp(-max(0.0, passed_s) / time_constant_s)
    return place[0] + share * (point[0] - place[0]), place[1] + share * (point[1] - place[1])
