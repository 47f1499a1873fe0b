"""One arm of a person: its hand over time."""

from __future__ import annotations

import math
import statistics
from collections import deque
from typing import NamedTuple

from deixis_schemas.messages import GestureKind, Phase, Side, Track

from .bearing import HandSight
from .config import GestureConfig
from .deixis_stroke import DeixisStroke
from .fingertips import Finger, find_fingers
from .hand import CHEST, Face, HandShape, hand_of, unpack_contour
from .hand_posture import PostureOdds, mean_of, posture_of
from .held_hand import held_hand
from .paper_stroke import PaperStroke
from .phases import PhaseTracker
from .stroke import Look, StrokeRules, Verdict

Point = tuple[float, float]

# Time over which it is averaged which side's hand it is.
SIDE_TIME_S = 0.205
# Tip and fist are the medians of so much of a stroke.
MEASURED_S = 0.48
# The outline is worth its cost only near a stroke: hands lower than this below the face are at rest.
LOW = 3.6


class _Measured(NamedTuple):
    """What one frame of a stroke shows."""

    time_s: float
    sight: HandSight
    posture: PostureOdds


class Arm:
    """Phase, gesture and shape of one hand. `resting_until_s`: a hand found raised before then may rest there."""

    def __init__(self, config: GestureConfig, resting_until_s: float) -> None:
        self._config = config
        self._phases = PhaseTracker(config)
        self._stroke = self._new_stroke()
        self._verdict = Verdict()
        self._resting_until_s = resting_until_s
        self._first_s: float | None = None
        self._leftness = 0.0
        self._measures: deque[_Measured] = deque()
        self._place_px = (0.0, 0.0)
        self._gone: Point = (0.0, 0.0)
        self._last: tuple[Point, Point] | None = None  # in the picture, pixels; and how far the room had moved
        self.track_id = -1
        self.seen_s = -math.inf
        self.fingers: list[Finger] = []
        self.stretch = 0.0

    @property
    def phase(self) -> Phase:
        """Phase of the hand."""
        return self._phases.phase

    @property
    def gesture(self) -> GestureKind:
        """Gesture of the stroke that the hand is in; `none` before it is decided and outside of strokes."""
        return self._verdict.gesture

    @property
    def verdict(self) -> Verdict:
        """What the rules say of the stroke so far."""
        return self._verdict

    @property
    def side(self) -> Side | None:
        """The person's own side of the hand, by its tracks' kinds; None where they never said."""
        if self._leftness == 0.0:
            return None
        return "left" if self._leftness > 0 else "right"

    @property
    def sight(self) -> HandSight | None:
        """What the stroke so far shows of the hand: medians of its last `MEASURED_S`; None without any."""
        if not self._measures:
            return None
        sights = [measured.sight for measured in self._measures]
        return HandSight(
            _middle([sight.tip for sight in sights]),
            _middle([sight.fist for sight in sights]),
            statistics.median(sight.radius for sight in sights),
        )

    @property
    def posture(self) -> PostureOdds | None:
        """The hand's posture in the same part of the stroke; None without any."""
        return mean_of([measured.posture for measured in self._measures]) if self._measures else None

    def distance_px(self, track: Track) -> float:
        """How far a track is from where this hand was seen last, pixels."""
        return math.dist(self._place_px, track.centroid_px)

    def update(
        self,
        track: Track,
        face: Face,
        room: Point,
        time_s: float,
        frame_s: float,
        *,
        walking: bool = False,
        fellow: Point | None = None,
    ) -> None:
        """Advance by an observed hand; `room`: how far the room has moved in the picture, face widths; `frame_s`: time since
        the frame before; `fellow`: where the person's other hand is about the face, face widths, none where it is not seen.
        """
        self.track_id, self.seen_s, self._place_px = track.track_id, time_s, track.centroid_px
        self._first_s = time_s if self._first_s is None else self._first_s
        self._weigh_side(track, frame_s)
        hand = self._shape(track, face)
        # Not of the outline, whose fingers come and go: a hand that was held still seemed to move.
        place = _about(face, track.centroid_px)
        self.stretch = math.dist(place, CHEST)
        phase = self._phases.update(time_s, self._gone_to(track.centroid_px, face.width_px, room), place, walking)
        self.fingers = find_fingers(hand) if hand and phase != "idle" else []
        if phase != "stroke":
            self._stroke, self._verdict = self._new_stroke(), Verdict()
            self._measures.clear()
        elif hand:
            self._verdict = self._stroke.add(self._look(hand, time_s, fellow))
            self._measure(hand, time_s)

    def _gone_to(self, at_px: Point, face_width_px: float, room: Point) -> Point:
        """Where a hand at this place of the picture is in the room, face widths from where it was seen first.

        Summed step by step: the face's width breathes, and a hand 600 pixels from the picture's corner seemed to move by half
        a face width a second, measured from there: it was never at rest, so that nothing was known of where it came from.
        """
        if self._last is not None:
            (last_x, last_y), (room_x, room_y) = self._last
            self._gone = (
                self._gone[0] + (at_px[0] - last_x) / face_width_px - (room[0] - room_x),
                self._gone[1] + (at_px[1] - last_y) / face_width_px - (room[1] - room_y),
            )
        self._last = at_px, room
        return self._gone

    def _new_stroke(self) -> StrokeRules:
        return PaperStroke(self._config.settle_s) if self._config.rules == "paper" else DeixisStroke(self._config)

    def _look(self, hand: HandShape, time_s: float, fellow: Point | None) -> Look:
        held = held_hand(hand, self.fingers, self.side, fellow)
        return Look(
            time_s,
            hand,
            tuple(self.fingers),
            held,
            self._phases.way,
            may_be_invisible=self._was_raised_before_us(),
            joined=self._is_joined(hand.centroid, fellow),
        )

    def _is_joined(self, place: Point, fellow: Point | None) -> bool:
        """The other hand is held up near this one: signers, claps and explaining hands; a pointing is made with one hand."""
        if fellow is None or fellow[1] > self._config.raised_below_face:
            return False
        return math.dist(place, fellow) <= self._config.hands_together

    def _measure(self, hand: HandShape, time_s: float) -> None:
        self._measures.append(_Measured(time_s, HandSight(hand.tip, hand.palm, hand.palm_radius), posture_of(hand)))
        while time_s - self._measures[0].time_s > MEASURED_S:
            self._measures.popleft()

    def _was_raised_before_us(self) -> bool:
        """The hand was seen rising, or came into sight later than the person did."""
        return self._phases.rose or (self._first_s is not None and self._first_s > self._resting_until_s)

    def _weigh_side(self, track: Track, frame_s: float) -> None:
        """By the time a frame stands for, not the time since the hand was seen: a gap says nothing of the side."""
        if track.kind in ("left_hand", "right_hand"):
            sense = 1.0 if track.kind == "left_hand" else -1.0
            self._leftness += (1 - math.exp(-frame_s / SIDE_TIME_S)) * (sense - self._leftness)

    def _shape(self, track: Track, face: Face) -> HandShape | None:
        if (track.bbox_px[1] - face.y_px) / face.width_px > LOW:
            return None
        return hand_of(face.normalised(unpack_contour(track.contour)))


def _middle(points: list[Point]) -> Point:
    xs, ys = zip(*points, strict=True)
    return statistics.median(xs), statistics.median(ys)


def _about(face: Face, point_px: tuple[float, float]) -> tuple[float, float]:
    return (point_px[0] - face.x_px) / face.width_px, (point_px[1] - face.y_px) / face.width_px
