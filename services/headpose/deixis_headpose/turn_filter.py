"""Angles of a head through time: what single looks say, weighed with how heads move.

A head rests or it turns: two models of its motion run side by side and are weighed by how well each foretold the next look
(interacting multiple models, Blom and Bar-Shalom 1988). One model alone is either slow in turns or restless at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .head import Array

RATE_FADES_S = 0.15
"""A turn that is not seen to go on dies away with this time constant."""
FIRST_RATE_DEG_S = 60.0
"""Spread of the rate at which a head is first seen turning."""
STEP_S = (1e-3, 10.0)
"""Looks nearer and farther apart than this are taken as if they were this far apart."""


@dataclass(frozen=True)
class Motion:
    """How heads move, as fitting/choose_headpose.py chose it.

    jerkiness: of the resting and the turning model, degrees / s^1.5 (at rest 10 to 40 are as good, to .01 degrees). stays_s:
    how long either lasts.
    """

    jerkiness: tuple[float, float] = (40.0, 400.0)
    stays_s: tuple[float, float] = (1.0, 0.35)


class TurnFilter:
    """Yaw, pitch and roll, degrees, each with its rate, in two models; the models' weights are shared by the angles."""

    def __init__(self, angles_deg: Array, variances_deg2: Array, motion: Motion) -> None:
        """angles_deg, variances_deg2: (3,) of the first look."""
        self._motion = motion
        state = np.stack([angles_deg, np.zeros(3)], axis=1)
        spread = np.zeros((3, 2, 2))
        spread[:, 0, 0], spread[:, 1, 1] = variances_deg2, FIRST_RATE_DEG_S**2
        self._states = np.stack([state, state])
        self._spreads = np.stack([spread, spread])
        self._weights = np.array([0.8, 0.2])

    @property
    def angles_deg(self) -> Array:
        """Yaw, pitch, roll (3,) in -180 to 180."""
        return _wrapped(np.einsum("m,mi->i", self._weights, self._states[:, :, 0]))

    @property
    def variances_deg2(self) -> Array:
        """Of the angles (3,)."""
        states = self._states[:, :, 0]
        mean = np.einsum("m,mi->i", self._weights, states)
        return np.asarray(np.einsum("m,mi->i", self._weights, self._spreads[:, :, 0, 0] + (states - mean) ** 2))

    def predict(self, step_s: float) -> None:
        """Go on in time without a look."""
        step = float(np.clip(step_s, *STEP_S))
        self._mix(step)
        fade = np.exp(-step / RATE_FADES_S)
        forth = np.array([[1.0, RATE_FADES_S * (1 - fade)], [0.0, fade]])
        self._states = self._states @ forth.T
        noise = np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
        jerkiness = np.array(self._motion.jerkiness)[:, None, None, None]
        self._spreads = forth @ self._spreads @ forth.T + jerkiness**2 * noise

    def update(self, angles_deg: Array, variances_deg2: Array) -> None:
        """Take a look (3,) with the variances of what differs from look to look."""
        apart = _wrapped(angles_deg - self._states[:, :, 0])
        expected = self._spreads[:, :, 0, 0] + variances_deg2
        gain = self._spreads[:, :, :, 0] / expected[:, :, None]
        self._states = self._states + gain * apart[:, :, None]
        self._spreads = self._spreads - gain[:, :, :, None] * self._spreads[:, :, 0, None, :]
        fit = -0.5 * np.sum(apart**2 / expected + np.log(expected), axis=1)
        weights = self._weights * np.exp(np.maximum(fit - fit.max(), -50.0))
        self._weights = weights / weights.sum()

    def _mix(self, step: float) -> None:
        """The models exchange what they know, by how likely either turns into the other."""
        leaves = 1 - np.exp(-step / np.array(self._motion.stays_s))
        moves = np.array([[1 - leaves[0], leaves[0]], [leaves[1], 1 - leaves[1]]])
        weights = self._weights @ moves
        shares = self._weights[:, None] * moves / weights
        states = np.einsum("ab,aij->bij", shares, self._states)
        apart = self._states[:, None] - states[None]
        between = apart[..., :, None] * apart[..., None, :]
        self._spreads = np.einsum("ab,abijk->bijk", shares, self._spreads[:, None] + between)
        self._states, self._weights = states, weights


def _wrapped(angles_deg: Array) -> Array:
    """Into -180 (included) to 180."""
    return np.asarray((angles_deg + 180.0) % 360.0 - 180.0)
