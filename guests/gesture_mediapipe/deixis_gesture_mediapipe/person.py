"""One person: the face that gives scale and origin, and the hands. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from deixis_runtime.lens import Lens
from deixis_schemas.messages import CameraMount, Gesture, Side, Track

from .arm import ArmSeen, Bearing, bearing_of
from .config import GestureConfig
from .fingers import INDEX_TIP, HandRead, pointing_deg
from .hand import Hand

Point = tuple[float, float]
ReadHand = Callable[[int, Point, float], HandRead | None]
"""Reads the hand of a track (its id) about a place, pixels, with a face of that width."""
WIDTH_S = 0.5
LEAST_FACE_PX = 6.0
POINTING = ("point_left", "point_right", "invisible")
SHORT_OF_TIP = 0.6
"""From the middle of a hand to the tip of its index finger, face widths."""


class Person:
    """Follows one person's hands and says which of them gestures."""

    def __init__(self, person_id: int, config: GestureConfig) -> None:
        self._person_id = person_id
        self._config = config
        self._centre: Point = (0.0, 0.0)
        self._width = 0.0
        self._face_s = -math.inf
        self._hands: dict[int, Hand] = {}
        self._sides: dict[int, Side] = {}

    def is_gone(self, now_s: float) -> bool:
        """The face has been missing for too long."""
        return now_s - self._face_s > self._config.forget_s

    def see(self, tracks: Sequence[Track], now_s: float, read_hand: ReadHand) -> None:
        """The person's tracks of the next frame."""
        face = next((track for track in tracks if track.kind == "face" and track.bbox_px[2] >= LEAST_FACE_PX), None)
        if face is not None:
            self._see_face(face, now_s)
        if not self._width:
            return
        for track in tracks:
            if track.kind != "face" and track.observed:
                self._see_hand(track, now_s, read_hand)
        self._hands = {key: hand for key, hand in self._hands.items() if now_s - hand.seen_s <= self._config.forget_s}

    def gesture(self, lens: Lens, size: tuple[int, int], mount: CameraMount) -> Gesture:
        """What the person does, seen through `lens` in a picture of that size."""
        hand = max(self._hands.values(), key=_precedence, default=None)
        if hand is None or hand.phase == "idle":
            return Gesture(person_id=self._person_id, phase="idle", gesture="none")
        side = self._sides.get(hand.track_id)
        bearing = self._bearing(hand, side, lens, size, mount) if hand.gesture in POINTING else None
        tip = self._tip(hand)
        return Gesture(
            person_id=self._person_id,
            phase=hand.phase,
            gesture=hand.gesture,
            hand=side,
            fingertips_px=[tip] if tip is not None and hand.gesture in ("point_left", "point_right") else [],
            bearing_deg=bearing.deg if bearing else None,
            bearing_sigma_deg=bearing.sigma_deg if bearing else None,
            bearing_mirrored=bearing.mirrored if bearing else False,
            bearing_likelihood=list(bearing.likelihood) if bearing else [],
            elevation_deg=bearing.elevation_deg if bearing else None,
            elevation_sigma_deg=bearing.elevation_sigma_deg if bearing else None,
        )

    def _see_face(self, face: Track, now_s: float) -> None:
        x, y, width, height = face.bbox_px
        share = 1.0 if not self._width else 1 - math.exp(-max(now_s - self._face_s, 0.0) / WIDTH_S)
        self._width += share * (width - self._width)
        self._centre, self._face_s = (x + width / 2, y + height / 2), now_s

    def _see_hand(self, track: Track, now_s: float, read_hand: ReadHand) -> None:
        hand = self._hands.setdefault(track.track_id, Hand(track.track_id, self._config))
        if track.kind in ("left_hand", "right_hand"):
            self._sides[track.track_id] = "left" if track.kind == "left_hand" else "right"
        x, y = track.centroid_px
        place = (x - self._centre[0]) / self._width, (y - self._centre[1]) / self._width
        hand.follow(place, now_s)
        hand.look(read_hand(track.track_id, (x, y), self._width) if hand.is_raised else None)

    def _tip(self, hand: Hand) -> Point | None:
        if hand.read is None:
            return None
        x, y = hand.read.points[INDEX_TIP]
        return float(x), float(y)

    def _bearing(self, hand: Hand, side: Side | None, lens: Lens, size: tuple[int, int], mount: CameraMount) -> Bearing:
        tip, finger = self._tip(hand), pointing_deg(hand.read) if hand.read is not None else None
        middle = (self._centre[0] + hand.place[0] * self._width, self._centre[1] + hand.place[1] * self._width)
        is_left = hand.place[0] > 0 if side is None else side == "left"
        short = 0.0 if tip is not None else SHORT_OF_TIP
        return bearing_of(ArmSeen(self._centre, self._width, tip or middle, is_left, finger, short), lens, size, mount)


def _precedence(hand: Hand) -> tuple[bool, bool, bool, float]:
    """Of several hands the one in a stroke, best a pointing; then one that moves; then the one farther out."""
    pointing = hand.gesture in POINTING
    return pointing, hand.phase == "stroke", hand.phase != "idle", abs(hand.place[0])
