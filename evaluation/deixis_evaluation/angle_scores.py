"""How far one angle of the head is off, and whether its stated sigma is true. Degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .proportion import Proportion

ONE_SIGMA, MOST_SIGMA = 1.0, 1.96
"""A normal error lies within so many sigmas in 68 % and in 95 % of frames."""


def signed_error_deg(angle_deg: float, true_deg: float) -> float:
    """Difference of two angles, -180 to 180."""
    return (angle_deg - true_deg + 180) % 360 - 180


@dataclass(frozen=True)
class AngleScore:
    """Errors (signed) of the frames in which an angle was stated, and of each its sigma, none where none was stated."""

    errors_deg: Sequence[float] = ()
    sigmas_deg: Sequence[float | None] = ()

    @property
    def frames(self) -> int:
        """How many frames state the angle."""
        return len(self.errors_deg)

    @property
    def mae_deg(self) -> float | None:
        """Mean absolute error."""
        return float(np.abs(self.errors_deg).mean()) if self.errors_deg else None

    @property
    def bias_deg(self) -> float | None:
        """Mean error with its sign: what no filter takes away."""
        return float(np.mean(self.errors_deg)) if self.errors_deg else None

    @property
    def sigma_median_deg(self) -> float | None:
        """Median of the stated sigmas."""
        stated = [sigma for sigma in self.sigmas_deg if sigma is not None]
        return float(np.median(stated)) if stated else None

    def percentile_deg(self, percent: float) -> float | None:
        """Absolute error that so many percent of the frames do not exceed."""
        return float(np.percentile(np.abs(self.errors_deg), percent)) if self.errors_deg else None

    def beyond(self, limit_deg: float) -> Proportion:
        """Frames that are off by more than the limit."""
        return Proportion.of(abs(error) > limit_deg for error in self.errors_deg)

    def within(self, sigmas: float) -> Proportion:
        """Of the frames that state a sigma: those whose error is at most so many of it."""
        pairs = zip(self.errors_deg, self.sigmas_deg, strict=True)
        return Proportion.of(abs(error) <= sigmas * sigma for error, sigma in pairs if sigma is not None)
