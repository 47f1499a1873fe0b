"""One head through time by single looks at it: what the looks say together, and how sure that is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .config import HeadposeConfig
from .head import Array, Pose
from .head_reader import HeadReader
from .regression import Look, Regression
from .sight import HeadState, Sight, side_of
from .turn_filter import Motion, TurnFilter


@dataclass(frozen=True)
class Calibration:
    """From what the network says of its errors to how large they are, each for yaw, pitch and roll.

    gain: times the network's sigma. apart: times the angle between what a crop and its mirror image say. floor_deg: at least.
    turned_deg: times the sine of the yaw. How wide and how deep a head is hides in its profile, and not in its front: errors
    that stay from look to look grew with the turn where the network's own sigma hardly did.
    """

    gain: tuple[float, float, float] = (0.49, 1.23, 0.43)
    apart: tuple[float, float, float] = (0.5, 0.32, 0.17)
    floor_deg: tuple[float, float, float] = (1.21, 0.5, 0.53)
    turned_deg: tuple[float, float, float] = (5.04, 3.08, 5.37)
    lasting: float = 0.85
    """Share of the variance that stays from look to look: it is the face's, not the picture's, and no filter takes it away."""

    def variances(self, look: Look) -> tuple[Array, Array]:
        """(3,) degrees squared of yaw, pitch, roll: what differs from look to look, and what stays."""
        factors = np.stack([self.gain, self.apart, self.floor_deg, self.turned_deg])
        whole = np.sum(factors**2 * signs_of_error(look), axis=0)
        return (1 - self.lasting) * whole, self.lasting * whole


def signs_of_error(look: Look) -> Array:
    """What a calibration weighs, squared, (4, 3): the network's sigma, the angle apart, 1, the sine of the yaw."""
    told, apart = np.degrees(look.sigma) ** 2, np.degrees(look.apart) ** 2
    turned = math.sin(math.radians(angles_of(look)[0])) ** 2
    return np.stack([told, np.full(3, apart), np.ones(3), np.full(3, turned)])


CALIBRATION = Calibration()
"""Chosen by `python fitting/choose_headpose.py --seeds 1000:1016`."""


class RegressedHead:
    """Follows one head. `calibration` and `motion` are given where they are chosen, see fitting/choose_headpose.py."""

    def __init__(
        self,
        config: HeadposeConfig,
        regression: Regression,
        calibration: Calibration = CALIBRATION,
        motion: Motion = Motion(),  # noqa: B008 - it cannot be changed
    ) -> None:
        self._config = config
        self._reader = HeadReader(regression)
        self._calibration, self._motion = calibration, motion
        self._turn: TurnFilter | None = None
        self._lost = False
        self._lasting: Array = np.zeros(3)
        self._seen_ns = 0
        self._told_ns = 0

    def update(self, sight: Sight) -> HeadState:
        """The head in the next frame."""
        state = self.take(self._reader.read(sight), sight.now_ns)
        return replace(state, face_width_px=self._reader.face_width_px)

    def take(self, look: Look | None, now_ns: int) -> HeadState:
        """Go on to `now_ns` with what was read there; none where no head was seen."""
        if look is None:
            return self._unseen(now_ns)
        passing, self._lasting = self._calibration.variances(look)
        angles = np.array(angles_of(look))
        if self._turn is None or self._lost:
            self._turn = TurnFilter(angles, passing, self._motion)
        else:
            self._turn.predict((now_ns - self._told_ns) * 1e-9)
            self._turn.update(angles, passing)
        self._lost = False
        self._seen_ns = self._told_ns = now_ns
        return self._state(self._turn)

    def _unseen(self, now_ns: int) -> HeadState:
        """No head was seen: the last angles for a while, their sigma growing."""
        if self._turn is None:
            return HeadState("initialising")
        self._lost = now_ns - self._seen_ns > self._config.hold_s * 1e9
        if self._lost:
            return HeadState("lost")
        self._turn.predict((now_ns - self._told_ns) * 1e-9)
        self._told_ns = now_ns
        return self._state(self._turn)

    def _state(self, turn: TurnFilter) -> HeadState:
        yaw, pitch, roll = (float(angle) for angle in turn.angles_deg)
        variances = turn.variances_deg2 + self._lasting
        if variances[0] > self._config.widest_sigma_deg**2:
            return HeadState("lost")
        of_yaw, of_pitch, of_roll = (float(value) for value in variances)
        # Fusion takes it as certain that the head looks out there: it is only said where the sigma leaves no other choice.
        if abs(yaw) - of_yaw**0.5 > self._config.range_deg:
            return HeadState("out_of_range", side=side_of(yaw), beyond_deg=self._config.range_deg)
        return HeadState("tracking", (yaw, pitch, roll), of_yaw**0.5, None, (of_yaw, of_pitch, of_roll))


def angles_of(look: Look) -> tuple[float, float, float]:
    """Yaw, pitch, roll of a look, degrees: relative to the line head -> camera, as Pose.angles_deg()."""
    return Pose(look.rotation, np.array([0.0, 0.0, 1.0])).angles_deg()
