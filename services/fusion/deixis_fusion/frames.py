"""The frames of a stroke side by side: what each showed, as arrays. A stroke of five seconds is 150 frames, each frame anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import BEARINGS

from .evidence import ROW, Sample

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

FULL_TURN_DEG = 360.0


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames in their order, the weight of each (n), and what each showed in numbers (n, columns): see `evidence.Row`."""

    samples: Sequence[Sample]
    weights: Values
    table: Values

    @staticmethod
    def of(samples: Sequence[Sample], weights: Values | None = None) -> Frames:
        """These frames, all of weight 1 where none is given."""
        table = np.frombuffer(b"".join([sample.row for sample in samples])).reshape(len(samples), len(ROW))
        return Frames(samples, np.ones(len(samples)) if weights is None else weights, table)

    def weighed(self, weights: Values) -> Frames:
        """The same frames with these weights."""
        return Frames(self.samples, weights, self.table)

    @cached_property
    def _unknown(self) -> Flags:
        return np.isnan(self.table)

    def tells(self, name: str) -> Flags:
        """Which frames tell one of the numbers (n)."""
        return ~self._unknown[:, ROW[name]]

    def __len__(self) -> int:
        return len(self.samples)

    def __getitem__(self, part: slice) -> Frames:
        """Consecutive frames."""
        return Frames(self.samples[part], self.weights[part], self.table[part])

    def column(self, name: str) -> Values:
        """One of the numbers, of each frame (n); not a number where a frame does not tell."""
        return self.table[:, ROW[name]]

    def curves(self, which: Flags) -> Values:
        """The likelihoods of bearings of those of the frames (m, `BEARINGS`), each of which tells one."""
        told = b"".join([sample.curve for sample in compress(self.samples, which.tolist())])
        return np.frombuffer(told).reshape(-1, BEARINGS)

    def placed(self) -> Frames:
        """Those of which is known where the person stood."""
        known = self.tells("axis_deg")
        if known.all():
            return self
        return Frames([self.samples[int(i)] for i in np.flatnonzero(known)], self.weights[known], self.table[known])

    def turns_to(self, axis_deg: float | None) -> Values:
        """What is added to bearings of each frame (n), to have them from the direction `axis_deg` in the map; degrees.

        0 without that direction, and in frames of which is not known where the person stood.
        """
        if axis_deg is None:
            return np.zeros(len(self))
        return np.where(self.tells("axis_deg"), wrapped(self.column("axis_deg") - axis_deg), 0.0)


def wrapped(angles_deg: Values) -> Values:
    """The same angles within -180 and 180 degrees."""
    return np.asarray((angles_deg + FULL_TURN_DEG / 2) % FULL_TURN_DEG - FULL_TURN_DEG / 2)
