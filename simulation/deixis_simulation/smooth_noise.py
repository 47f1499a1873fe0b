"""Smooth noise that is a function of time alone: the same whenever, and in whatever order, it is asked for."""

from __future__ import annotations

import math

import numpy as np

from .geometry import Floats


class SmoothNoise:
    """`channels` independent sums of four sines each, within -1 to 1, of frequencies in `band_hz`."""

    def __init__(self, dice: np.random.Generator, channels: int, band_hz: tuple[float, float]) -> None:
        shape = (channels, 4)
        self._rate = 2 * math.pi * dice.uniform(*band_hz, shape)
        self._start = dice.uniform(0, 2 * math.pi, shape)
        share = dice.uniform(0.4, 1.0, shape)
        self._share = share / share.sum(axis=1, keepdims=True)

    def at(self, time_s: float) -> Floats:
        """All channels (channels,) at a time."""
        waves: Floats = (self._share * np.sin(self._rate * time_s + self._start)).sum(axis=1)
        return waves
