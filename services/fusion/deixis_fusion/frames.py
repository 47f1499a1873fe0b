"""The frames of a stroke side by side: what each showed, as arrays. A stroke of five seconds is 150 frames, each frame anew."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import BEARINGS

from .evidence import ROW, Sample

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

FULL_TURN_DEG = 360.0
FIRST_ROWS = 64


class FrameLog(Sequence[Sample]):
    """Frames of a stroke as they come, and what each showed, so that with each new frame one row is written and no more.

    Only rows beyond those there are get written: what was taken from a log before stays as it was.
    """

    def __init__(self, samples: Iterable[Sample] = ()) -> None:
        self._samples: list[Sample] = []
        self._rows = np.empty((FIRST_ROWS, len(ROW)))
        self._curves = np.empty((FIRST_ROWS, BEARINGS))
        for sample in samples:
            self.append(sample)

    def append(self, sample: Sample) -> None:
        """One more frame."""
        count = len(self._samples)
        if count == len(self._rows):
            self._rows, self._curves = _doubled(self._rows), _doubled(self._curves)
        self._rows[count] = np.frombuffer(sample.row)
        self._curves[count] = np.frombuffer(sample.curve) if sample.curve else 0.0
        self._samples.append(sample)

    @property
    def table(self) -> Values:
        """What each frame showed in numbers (n, columns)."""
        return self._rows[: len(self)]

    @property
    def curves(self) -> Values:
        """Of each frame the likelihoods of bearings (n, `BEARINGS`), 0 where it tells none."""
        return self._curves[: len(self)]

    def __len__(self) -> int:
        return len(self._samples)

    @overload
    def __getitem__(self, i: int) -> Sample: ...
    @overload
    def __getitem__(self, i: slice) -> list[Sample]: ...
    def __getitem__(self, i: int | slice) -> Sample | list[Sample]:
        return self._samples[i]

    def __iter__(self) -> Iterator[Sample]:
        return iter(self._samples)

    def __reversed__(self) -> Iterator[Sample]:
        return reversed(self._samples)


def _doubled(rows: Values) -> Values:
    return np.concatenate([rows, np.empty_like(rows)])


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames in their order, the weight of each (n), and what each showed: numbers (n, columns), see `evidence.ROW`, and the
    likelihoods of bearings (n, `BEARINGS`), 0 where it tells none.
    """

    samples: Sequence[Sample]
    weights: Values
    table: Values
    curves: Values

    @staticmethod
    def of(samples: Sequence[Sample], weights: Values | None = None) -> Frames:
        """These frames, all of weight 1 where none is given."""
        log = samples if isinstance(samples, FrameLog) else FrameLog(samples)
        return Frames(log[:], np.ones(len(log)) if weights is None else weights, log.table, log.curves)

    def weighed(self, weights: Values) -> Frames:
        """The same frames with these weights."""
        return Frames(self.samples, weights, self.table, self.curves)

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
        return Frames(self.samples[part], self.weights[part], self.table[part], self.curves[part])

    def column(self, name: str) -> Values:
        """One of the numbers, of each frame (n); not a number where a frame does not tell."""
        return self.table[:, ROW[name]]

    def placed(self) -> Frames:
        """Those of which is known where the person stood."""
        known = self.tells("axis_deg")
        if known.all():
            return self
        samples = [self.samples[int(i)] for i in np.flatnonzero(known)]
        return Frames(samples, self.weights[known], self.table[known], self.curves[known])

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
