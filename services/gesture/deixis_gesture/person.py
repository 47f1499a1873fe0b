"""One person: the face that gives scale and origin, and the hands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from deixis_runtime.lens import Lens
from deixis_runtime.mount import Vector, to_base
from deixis_schemas.messages import CameraMount, Gesture, Track

from .arm import Arm
from .bearing import ArmSight, Bearing, HandSight, Ray, estimate_bearing
from .config import GestureConfig
from .hand import Face

# The face's box jitters and, with a turning head, changes its width; distance to a person changes slowly.
WIDTH_TIME_S = 0.7
PLACE_TIME_S = 0.12
LEAST_FACE_PX = 6.0
# Of a head the middle is so far above that of its face's box, which goes from chin to brow; face widths.
HEAD_ABOVE_FACE = 0.08
# A hand that comes back within this of where one was lost is the same hand, face widths.
SAME_HAND = 1.2
# A person seen for less than this may stand with resting hands raised: nobody saw them being raised.
FIRST_LOOK_S = 0.7
POINTING = ("point_left", "point_right", "invisible")


class View(NamedTuple):
    """What a frame was taken through: the lens, the frame's size (width, height), how the camera sits, and how far the room
    moved in the picture since the frame before, pixels.
    """

    lens: Lens
    size: tuple[int, int]
    mount: CameraMount
    room_went_px: tuple[float, float] = (0.0, 0.0)

    def arm_of(self, face: Face, sight: HandSight) -> ArmSight:
        """The arm of a person with this face, as a level camera sees it that looks at the head."""
        head = (face.x_px, face.y_px - HEAD_ABOVE_FACE * face.width_px)
        x, y, z = self._level(head)
        floor = math.hypot(x, y)
        # Far beside the axis a picture shows things larger: the lens near the face says how far it is along the sight.
        away = self.lens.pinhole_at(head, self.size).focal_px / face.width_px
        distance = away * floor / math.hypot(floor, z)
        tip, fist = (self._beside((x / floor, y / floor), face.pixels(place)) for place in (sight.tip, sight.fist))
        return ArmSight(tip, fist, sight.radius, distance, distance * z / floor)

    def _beside(self, ahead: tuple[float, float], pixel: tuple[float, float]) -> Ray:
        """A pixel beside the direction `ahead` on the floor."""
        x, y, z = self._level(pixel)
        floor = math.hypot(x, y)
        right = ahead[1] * x - ahead[0] * y
        return Ray(right / max(ahead[0] * x + ahead[1] * y, 1e-3 * floor), z / floor)

    def _level(self, pixel: tuple[float, float]) -> Vector:
        """Direction of a pixel: forward, left, up."""
        x, y = self.lens.ray(pixel, self.size)
        return to_base((x, y, 1.0), self.mount)


class Person:
    """Follows the face and the hands of one person and says which hand gestures."""

    def __init__(self, person_id: int, config: GestureConfig) -> None:
        self._person_id = person_id
        self._config = config
        self._face: Face | None = None
        self._face_speed = 0.0
        self._face_s = -math.inf
        self._room = (0.0, 0.0)  # how far the room has moved in the picture, face widths
        self._resting_until_s = math.inf
        self._arms: list[Arm] = []
        self._current: Arm | None = None

    @property
    def arms(self) -> Sequence[Arm]:
        """The hands that are seen, or were a moment ago."""
        return self._arms

    def is_gone(self, time_s: float) -> bool:
        """The face has been missing for too long."""
        return time_s - self._face_s > self._config.forget_s

    def update(self, tracks: Sequence[Track], view: View, time_s: float, frame_s: float) -> Gesture | None:
        """Gesture of the person as seen at `time_s`, `frame_s` after the frame before; None without a usable face."""
        if math.isinf(self._resting_until_s):
            self._resting_until_s = time_s + FIRST_LOOK_S
        self._follow_face(tracks, view.room_went_px, time_s)
        if self._face is None:
            return None
        # Summed in face widths, step by step: the width breathes, and would shake a long way that is divided by it.
        (x, y), (dx, dy) = self._room, view.room_went_px
        self._room = x + dx / self._face.width_px, y + dy / self._face.width_px
        walking = self._face_speed > self._config.walking_speed
        hands = [track for track in tracks if track.kind != "face" and track.observed and track.contour]
        for arm, track in self._assigned(hands, SAME_HAND * self._face.width_px):
            fellow = _fellow(track, hands, self._face)
            arm.update(track, self._face, self._room, time_s, frame_s, walking=walking, fellow=fellow)
        self._arms = [arm for arm in self._arms if time_s - arm.seen_s <= self._config.forget_s]
        self._current = self._gesturing()
        return self._spoken(self._current, self._face, view)

    def _follow_face(self, tracks: Sequence[Track], room_went_px: tuple[float, float], time_s: float) -> None:
        seen = [t for t in tracks if t.kind == "face" and t.bbox_px[2] >= LEAST_FACE_PX]
        if not seen:
            return
        x, y, w, h = max(seen, key=lambda t: (t.observed, t.confidence)).bbox_px
        now = Face(x + w / 2, y + h / 2, w)
        old, passed = self._face, time_s - self._face_s
        self._face_s = time_s
        if old is None or passed <= 0 or passed > self._config.forget_s:
            self._face = now
            return
        old = Face(old.x_px + room_went_px[0], old.y_px + room_went_px[1], old.width_px)
        place, scale = 1 - math.exp(-passed / PLACE_TIME_S), 1 - math.exp(-passed / WIDTH_TIME_S)
        self._face = Face(
            old.x_px + place * (now.x_px - old.x_px),
            old.y_px + place * (now.y_px - old.y_px),
            old.width_px + scale * (now.width_px - old.width_px),
        )
        speed = abs(self._face.x_px - old.x_px) / passed / self._face.width_px
        self._face_speed += place * (speed - self._face_speed)

    def _assigned(self, hands: Sequence[Track], near_px: float) -> list[tuple[Arm, Track]]:
        """Each hand with its arm: by the track's id, else the arm lost within `near_px`, else a new one."""
        by_id = {arm.track_id: arm for arm in self._arms}
        pairs = [(by_id[t.track_id], t) for t in hands if t.track_id in by_id]
        free = [arm for arm in self._arms if all(arm is not taken for taken, _ in pairs)]
        for track in hands:
            if track.track_id in by_id:
                continue
            near = [arm for arm in free if arm.distance_px(track) <= near_px]
            if near:
                arm = min(near, key=lambda a: a.distance_px(track))
                free.remove(arm)
            else:
                arm = Arm(self._config, self._resting_until_s)
                self._arms.append(arm)
            pairs.append((arm, track))
        return pairs

    def _gesturing(self) -> Arm | None:
        """The hand to speak of: one in a stroke, best a pointing; else the one spoken of so far while it moves."""

        def precedence(arm: Arm) -> tuple[bool, bool, bool, bool, float]:
            in_stroke = arm.phase == "stroke"
            pointing = in_stroke and arm.gesture in POINTING
            return in_stroke, pointing, arm is self._current and arm.phase != "idle", arm.phase != "idle", arm.stretch

        return max(self._arms, key=precedence, default=None)

    def _spoken(self, arm: Arm | None, face: Face, view: View) -> Gesture:
        if arm is None or arm.phase == "idle":
            return Gesture(person_id=self._person_id, phase="idle", gesture="none")
        gesture = arm.gesture if arm.phase == "stroke" else "none"
        bearing = _bearing(arm, face, view) if gesture in POINTING else None
        posture = arm.posture
        return Gesture(
            person_id=self._person_id,
            phase=arm.phase,
            gesture=gesture,
            hand=arm.side,
            fingertips_px=[face.pixels(finger.tip) for finger in arm.fingers[:5]],
            bearing_deg=bearing.deg if bearing else None,
            bearing_sigma_deg=bearing.sigma_deg if bearing else None,
            bearing_mirrored=bearing.mirrored if bearing else False,
            bearing_likelihood=list(bearing.likelihood) if bearing else [],
            elevation_deg=bearing.elevation_deg if bearing else None,
            elevation_sigma_deg=bearing.elevation_sigma_deg if bearing else None,
            point_probability=arm.verdict.probability,
            point_log_odds=dict(arm.verdict.log_odds),
            hand_posture=posture.named if posture else None,
            hand_posture_probability=max(posture.shares) if posture else None,
        )


def _fellow(track: Track, hands: Sequence[Track], face: Face) -> tuple[float, float] | None:
    """Where the person's other hand is about the face; of several the nearest to this one; none without any."""
    others = [other.centroid_px for other in hands if other is not track]
    if not others:
        return None
    near = min(others, key=lambda place: math.dist(place, track.centroid_px))
    x, y = face.normalised([near])[0]
    return float(x), float(y)


def _bearing(arm: Arm, face: Face, view: View) -> Bearing | None:
    """Bearing of the arm's pointing."""
    sight = arm.sight
    return None if sight is None else estimate_bearing(view.arm_of(face, sight), arm.side)
