"""A person who just stands: sway, breath, small movements of head and arms, blinks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from .arms import Arm, hanging_arm
from .body import Body
from .rotations import turn
from .scene import ArmSide, Person
from .skeleton import SIDES, Posture
from .smooth_noise import SmoothNoise

_BREATH_HZ = 0.27
_BLINK_S = 0.1
_MEAN_BLINK_S = 3.0


class Idle:
    """The usual posture of one person over time."""

    def __init__(self, person: Person, body: Body, dice: np.random.Generator) -> None:
        self._person = person
        self._slow = SmoothNoise(dice, 24, (0.15, 0.9))
        self._fast = SmoothNoise(dice, 8, (1.5, 5.0))
        self._blink_start = float(dice.uniform(0, _MEAN_BLINK_S))
        self._blink_seed = int(dice.integers(1 << 31))
        self._hanging = {side: hanging_arm(body, side, *dice.uniform(-0.02, 0.02, 3)) for side in SIDES}

    def posture(self, time_s: float) -> Posture:
        """The posture at a time."""
        size = self._person.restlessness
        n = self._slow.at(time_s) * size
        breath = math.sin(2 * math.pi * _BREATH_HZ * time_s)
        yaw, pitch, roll = self._person.head_deg
        return Posture(
            arms={side: self.unsteady(self._hanging[side], side, time_s, 1.0) for side in SIDES},
            offset=np.array([0.006 * n[0], 0.0, 0.004 * n[1]]),
            hips=(1.2 * n[2], 0.0, 0.5 * n[3]),
            spine=(1.0 * n[6], 0.8 * n[4] + 0.4 * breath, 0.5 * n[3] + 0.4 * n[5]),
            head=(yaw + 1.5 * n[7], pitch + 1.2 * n[8], roll + 1.0 * n[9]),
            gaze=(0.8 * n[10], 0.6 * n[11]),
            morphs=dict.fromkeys(("LeyeClose", "ReyeClose"), self._lids(time_s)),
        )

    def unsteady(self, arm: Arm, side: ArmSide, time_s: float, size: float) -> Arm:
        """The arm with the small movements that nobody can avoid."""
        row = SIDES.index(side) * 4
        size *= self._person.restlessness
        slow, fast = self._slow.at(time_s)[12 + row : 16 + row], self._fast.at(time_s)[row : row + 3]
        shake = (slow[:3] * 0.8 + fast * 0.1) * size
        return replace(
            arm, upper=turn(shake[1], shake[0], shake[2]) @ arm.upper, fore=arm.fore @ turn(0, 0, 0.8 * size * slow[3])
        )

    def _lids(self, time_s: float) -> float:
        """How far the lids are closed: one blink in each span of the mean duration, somewhere in it."""
        span = math.floor((time_s - self._blink_start) / _MEAN_BLINK_S)
        near = (self._blink_start + (number + self._offset(number)) * _MEAN_BLINK_S for number in (span - 1, span, span + 1))
        return max(0.0, 1 - min(abs(time_s - blink) for blink in near) / _BLINK_S)

    def _offset(self, number: int) -> float:
        return float(np.random.default_rng([self._blink_seed, max(number + 8, 0)]).uniform(0.05, 0.95))
