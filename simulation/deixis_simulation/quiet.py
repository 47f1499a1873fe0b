"""A gesture that is no pointing, over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arms import mix_arms
from .body import Body
from .envelope import envelope_of, shape_share
from .gestures import gesture_arms
from .idle import Idle
from .scene import Quiet
from .skeleton import Posture
from .smooth_noise import SmoothNoise


@dataclass(frozen=True, eq=False)
class QuietPlan:
    """One such gesture of one person."""

    action: Quiet
    body: Body
    noise: SmoothNoise

    def apply(self, posture: Posture, time_s: float, idle: Idle) -> None:
        """Put the gesture, as far as it is at a time, into a posture."""
        envelope = envelope_of(self.action)
        share, phase = envelope.share(time_s), envelope.phase(time_s)
        if phase == "none":
            return
        if self.action.gesture == "beats":
            self._speak(posture, time_s, share)
        since = time_s - self.action.start_s - self.action.preparation_s
        for side, arm in gesture_arms(self.action, self.body, posture, since, time_s, self.noise).items():
            held = idle.unsteady(arm, side, time_s, 0.45)
            posture.arms[side] = mix_arms(posture.arms[side], held, share, shape_share(share, phase))

    def _speak(self, posture: Posture, time_s: float, share: float) -> None:
        """Who gestures while talking moves mouth and head."""
        n = self.noise.at(2.4 * time_s)
        posture.morphs.update(
            MouthOpen=0.22 * abs(n[8]) * share, AE_AA=0.35 * max(n[9], 0.0) * share, UH_OO=0.4 * max(n[10], 0.0) * share
        )
        yaw, pitch, roll = posture.head
        posture.head = (yaw + 2 * n[11] * share, pitch + 2.5 * n[12] * share, roll + 2 * n[13] * share)


def plan_quiet(action: Quiet, body: Body, dice: np.random.Generator) -> QuietPlan:
    """Work out a gesture; its irregularities are drawn from `dice`."""
    return QuietPlan(action, body, SmoothNoise(dice, 14, (0.35, 1.6)))
