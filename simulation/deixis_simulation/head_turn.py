"""A look to the side, and back."""

from __future__ import annotations

from dataclasses import dataclass

from .envelope import envelope_of
from .scene import HeadTurn
from .skeleton import Posture
from .trunk import Look, enough_trunk_deg, usual_trunk_deg

_EYES_LEAD_S = 0.12


@dataclass(frozen=True)
class HeadTurnPlan:
    """One look, worked out: `azimuth_deg` is in the person's frame, from straight ahead."""

    action: HeadTurn
    azimuth_deg: float
    trunk_deg: float

    def apply(self, posture: Posture, time_s: float) -> None:
        """Put the look, as far as it is at a time, into a posture."""
        envelope = envelope_of(self.action)
        share = envelope.share(time_s)
        eyes = envelope.share(time_s, -_EYES_LEAD_S, 0.0)
        posture.turn_trunk(self.trunk_deg * share, 0.3)
        Look((self.azimuth_deg, self.action.pitch_deg, 0.0), (0.0, 0.0)).mix_into(posture, share, max(eyes - share, 0.0))


def plan_head_turn(action: HeadTurn, camera_azimuth_deg: float) -> HeadTurnPlan:
    """Work out a look. `camera_azimuth_deg`: where the camera is, in the person's frame."""
    azimuth = camera_azimuth_deg + action.azimuth_deg
    azimuth = (azimuth + 180.0) % 360.0 - 180.0
    return HeadTurnPlan(action, azimuth, enough_trunk_deg(usual_trunk_deg(azimuth) * action.torso_gain, azimuth))
