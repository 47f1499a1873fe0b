"""Gestures that are no pointing: where arms and hands are while each of them stands.

Every gesture is a function from `Doing` to the arms that take part. Directions are (out, up, ahead): out is away from the
body on the arm's side; so each is written once for both arms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .arms import Arm, arm_from_directions, arm_to_wrist, outward
from .avatars import BONE_PREFIX
from .body import Body
from .geometry import Floats
from .hand_shapes import CLAW, FIST, FLAT, GRIP, OPEN, PINCH, REST, THUMB_UP, HandShape, mix_shapes
from .scene import ArmSide, Quiet, QuietGesture
from .skeleton import SIDES, Posture, Skeleton, solve
from .smooth_noise import SmoothNoise

Direction = tuple[float, float, float]
Arms = dict[ArmSide, Arm]
AHEAD_OF_BODY: Direction = (0.0, 0.0, 1.0)
INWARD: Direction = (-1.0, 0.0, 0.0)
_PASSES = 2.0
TWO_HANDED: frozenset[QuietGesture] = frozenset({"beats", "hips", "crossed", "carry"})
"""Gestures of both arms; the others are of the action's arm."""


@dataclass(frozen=True, eq=False)
class Doing:
    """A gesture at a moment: since_s since the begin of its stroke; `skeleton` is the body without it."""

    action: Quiet
    body: Body
    chest: Floats
    skeleton: Skeleton
    since_s: float
    time_s: float
    noise: SmoothNoise

    @property
    def wave(self) -> float:
        """Of what is repeated, -1 to 1."""
        return math.sin(2 * math.pi * self.action.rate_hz * self.since_s)

    @property
    def progress(self) -> float:
        """Share of the stroke that is over."""
        return min(max(self.since_s / self.action.hold_s, 0.0), 1.0)

    def arm(self, side: ArmSide, upper: Direction, fore: Direction, hand: Direction, shape: HandShape, palm: Direction) -> Arm:
        """An arm from the directions of its bones."""
        along, before, at_end, looks = (_mirrored(side, way) for way in (upper, fore, hand, palm))
        return arm_from_directions(self.body, side, self.chest, along, before, at_end, shape, palm=looks)

    def at_head(
        self, place: Direction, hand: Direction, shape: HandShape, palm: Direction, elbow: Direction, follows: bool = True
    ) -> Arms:
        """The action's arm with its wrist at a place of the head: metres of an adult from its middle."""
        side, head = self.action.arm, self.skeleton.rotation("Head") if follows else np.eye(3)
        middle = self.skeleton.carried("Head", self.body.head_centre)
        wrist = middle + head @ (_mirrored(side, place) * self.body.head_scale)
        return {side: self._reaching(side, wrist, elbow, head @ _mirrored(side, hand), shape, head @ _mirrored(side, palm))}

    def at_body(
        self, side: ArmSide, bone: str, place: Direction, hand: Direction, shape: HandShape, palm: Direction, elbow: Direction
    ) -> Arm:
        """An arm with its wrist at a place of a bone of the trunk: metres of an adult from it; directions of that bone."""
        turned = self.skeleton.rotation(bone)
        wrist = self.skeleton.position(bone) + turned @ (_mirrored(side, place) * self.body.scale)
        return self._reaching(side, wrist, elbow, turned @ _mirrored(side, hand), shape, turned @ _mirrored(side, palm))

    def _reaching(self, side: ArmSide, wrist: Floats, elbow: Direction, hand: Floats, shape: HandShape, palm: Floats) -> Arm:
        shoulder = self.skeleton.position(f"{BONE_PREFIX[side]}Arm")
        toward = self.chest @ _mirrored(side, elbow)
        return arm_to_wrist(self.body, side, self.chest, shoulder, wrist, toward, hand, shape, palm=palm)


def gesture_arms(action: Quiet, body: Body, posture: Posture, since_s: float, time_s: float, noise: SmoothNoise) -> Arms:
    """Arms of a quiet gesture as it would stand `since_s` after the begin of its stroke, on a body in that posture."""
    doing = Doing(action, body, posture.spine_turn(), solve(body, posture), since_s, time_s, noise)
    return _GESTURES[action.gesture](doing)


def _mirrored(side: ArmSide, way: Direction) -> Floats:
    return np.array([outward(side) * way[0], way[1], way[2]])


def _wave(do: Doing) -> Arms:
    w = do.wave
    fore, hand = (0.12 + 0.36 * w, 1.0, 0.28), (0.08 + 0.55 * w, 1.0, 0.15)
    return {do.action.arm: do.arm(do.action.arm, (0.72, -0.55, 0.35), fore, hand, OPEN, AHEAD_OF_BODY)}


def _stop(do: Doing) -> Arms:
    hand = (0.0, 1.0, 0.12 + 0.02 * do.wave)
    shape = mix_shapes(OPEN, FLAT, 0.4)
    return {do.action.arm: do.arm(do.action.arm, (0.35, -0.6, 0.72), (-0.12, 0.62, 0.80), hand, shape, AHEAD_OF_BODY)}


def _thumb(do: Doing) -> Arms:
    bob = 0.03 * do.wave
    fore, hand = (-0.25, 0.25 + bob, 1.0), (-0.2, 0.25 + bob, 1.0)
    return {do.action.arm: do.arm(do.action.arm, (0.3, -0.85, 0.3), fore, hand, THUMB_UP, (-1.0, 0.0, 0.25))}


def _scratch(do: Doing) -> Arms:
    w = do.wave
    place, hand = (0.18, -0.09 + 0.012 * w, -0.03), (-0.62, 1.0, -0.30 + 0.08 * w)
    return do.at_head(place, hand, mix_shapes(CLAW, REST, 0.4 + 0.3 * w), (-1.0, -0.4, 0.0), (1.0, -0.35, 0.2))


def _phone(do: Doing) -> Arms:
    return do.at_head((0.135, -0.15, 0.03), (-0.04, 1.0, -0.25), CLAW, INWARD, (0.6, -1.0, 0.2))


def _beats(do: Doing) -> Arms:
    slow, fast = do.noise.at(0.9 * do.time_s), do.noise.at(1.7 * do.time_s + 50.0)
    arms: Arms = {}
    for side in SIDES:
        n, m = (slow[:4], fast[0]) if side == "right" else (slow[4:8], fast[4])
        upper = (0.32 + 0.08 * n[0], -0.9, 0.12 + 0.1 * n[1])
        fore = (-0.18 - 0.35 * n[1], 0.18 + 0.40 * n[0], 0.9)
        hand = (-0.1 - 0.3 * n[2], 0.25 + 0.3 * n[0], 1.0)
        shape = mix_shapes(REST, OPEN, 0.5 + 0.4 * m)
        arms[side] = do.arm(side, upper, fore, hand, shape, (-0.6, 0.5 + 0.5 * n[3], 0.1))
    return arms


def _drink(do: Doing) -> Arms:
    sip = math.sin(math.pi * 0.5 * do.since_s) ** 2
    place, hand = (0.12, -0.215 + 0.025 * sip, 0.17), (-0.80, 0.50 + 0.15 * sip, 0.05)
    return do.at_head(place, hand, GRIP, (-0.35, 0.0, -1.0), (0.5, -1.0, 0.1))


def _hips(do: Doing) -> Arms:
    place, hand, palm, elbow = (0.215, 0.10, 0.0), (-0.55, -0.30, 0.75), (-0.8, 0.0, -0.6), (1.0, 0.0, -0.45)
    return {side: do.at_body(side, "Hips", place, hand, FLAT, palm, elbow) for side in SIDES}


def _crossed(do: Doing) -> Arms:
    """The arm of the action lies above the other."""
    arms: Arms = {}
    for side in SIDES:
        above = side == do.action.arm
        fore = (-0.95, 0.22, 0.34) if above else (-0.95, 0.04, 0.16)
        hand = (-0.9, 0.25, -0.05) if above else (-0.9, 0.10, 0.0)
        arms[side] = do.arm(side, (0.20, -0.88, 0.42), fore, hand, FLAT, (0.0, -0.25, -1.0))
    return arms


def _chin(do: Doing) -> Arms:
    shape = mix_shapes(CLAW, FIST, 0.5)
    return do.at_head((0.045, -0.235, 0.125), (-0.22, 1.0, -0.10), shape, (-0.3, 0.0, -1.0), (0.35, -1.0, 0.1))


def _hair(do: Doing) -> Arms:
    """The hand goes over the hair, from the forehead back."""
    back = 0.5 - 0.5 * math.cos(math.pi * do.progress * _PASSES)
    place = (0.20 - 0.01 * back, 0.03, 0.09 - 0.12 * back)
    hand = (-0.9, 0.46, -0.1 - 0.2 * back)
    return do.at_head(place, hand, mix_shapes(CLAW, FLAT, 0.6), (-0.5, -0.9, -0.1), (1.0, -0.2, 0.2))


def _glasses(do: Doing) -> Arms:
    push = 0.006 * do.wave
    return do.at_head((0.125, -0.115 + push, 0.135), (-0.25, 0.85, -0.35), PINCH, (-0.9, 0.0, -0.45), (0.6, -1.0, 0.15))


def _carry(do: Doing) -> Arms:
    bob = 0.02 * do.wave
    fore, hand = (-0.12, 0.02 + bob, 1.0), (-0.22, 0.10 + bob, 1.0)
    return {side: do.arm(side, (0.14, -1.0, 0.06), fore, hand, GRIP, (-0.9, 0.45, 0.0)) for side in SIDES}


def _facepass(do: Doing) -> Arms:
    """The open hand passes before the face, without touching it."""
    way = math.cos(math.pi * do.progress * _PASSES)
    place = (0.08 + 0.18 * way, -0.12, 0.24)
    return do.at_head(place, (-0.75, 0.65, 0.0), mix_shapes(OPEN, FLAT, 0.6), (0.0, 0.0, -1.0), (0.7, -1.0, 0.1), follows=False)


_GESTURES: dict[QuietGesture, Callable[[Doing], Arms]] = {
    "wave": _wave, "stop": _stop, "thumb": _thumb, "scratch": _scratch, "phone": _phone, "beats": _beats, "drink": _drink,
    "hips": _hips, "crossed": _crossed, "chin": _chin, "hair": _hair, "glasses": _glasses, "carry": _carry,
    "facepass": _facepass,
}  # fmt: skip
