"""The frames of a stroke side by side: what each showed, as arrays. A stroke of five seconds is 150 frames, each frame anew."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import overload

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import BEARINGS, Side

from .evidence import FLAGS, ROW, SIDES, Sample, View
from .localisation import wrapped_deg
from .pointing import PointingGesture
from .walk import Walk

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

FULL_TURN_DEG = 360.0
FIRST_ROWS = 64
# At the start of a stroke the head may still be on its way: its first frames count for less.
EARLY_WEIGHT = 0.2
# Of sums of weights: what differs by less is as much.
ROUNDING = 1e-9
_FLAGGED, _AXIS = slice(0, len(FLAGS)), ROW["axis_deg"]


class FrameLog(Sequence[Sample]):
    """Frames of a stroke as they come, and what each showed, so that with each new frame one row is written and no more.

    Only rows beyond those there are get written: what was taken from a log before stays as it was. `walk` are the places of
    those frames of which one is known, `axis_deg` the last direction to the camera. `shown` is for `views.py`: what parts of
    the log show, which stays as it is.
    """

    def __init__(self, samples: Iterable[Sample] = ()) -> None:
        self._samples: list[Sample] = []
        self._columns = np.empty((len(ROW), FIRST_ROWS))
        self._curves = np.empty((FIRST_ROWS, BEARINGS))
        self._placed: FrameLog | None = None
        self._looked_at = 0
        self.axis_deg = 0.0
        self.walk = Walk()
        self.shown: dict[tuple[int, int, PointingGesture | None], View] = {}
        for sample in samples:
            self.append(sample)

    def append(self, sample: Sample) -> None:
        """One more frame."""
        count = len(self._samples)
        if count == len(self._curves):
            self._columns = np.concatenate([self._columns, np.empty_like(self._columns)], axis=1)
            self._curves = np.concatenate([self._curves, np.empty_like(self._curves)])
        self._columns[:, count] = np.frombuffer(sample.row())
        if self.walk and sample.place is not None:
            # On from the last one: a turn is small then, wherever the circle is cut.
            self._columns[_AXIS, count] = self.axis_deg + wrapped_deg(sample.place.axis_deg - self.axis_deg)
        curve = sample.curve()
        self._curves[count] = np.frombuffer(curve) if curve else 0.0
        self._add(sample)

    def only(self, kept: Flags) -> FrameLog:
        """A log of some of these frames."""
        log, which = FrameLog(), np.flatnonzero(kept)
        log._columns, log._curves = self._columns[:, which], self._curves[which]
        for i in which.tolist():
            log._add(self._samples[i])
        return log

    def since(self, at_ns: float) -> FrameLog:
        """A log of the frames from that time on."""
        return self.only(self.table[ROW["at_ns"]] >= at_ns)

    def placed(self) -> FrameLog:
        """A log of those frames of which is known where the person stood; it grows as this one does."""
        if len(self.walk) == len(self):
            return self
        if self._placed is None:
            self._placed = FrameLog()
        for sample in self._samples[self._looked_at :]:
            if sample.place is not None:
                self._placed.append(sample)
        self._looked_at = len(self)
        return self._placed

    @property
    def table(self) -> Values:
        """What each frame showed in numbers (columns, n)."""
        return self._columns[:, : len(self)]

    @property
    def curves(self) -> Values:
        """Of each frame the likelihoods of bearings (n, `BEARINGS`), 0 where it tells none."""
        return self._curves[: len(self)]

    def _add(self, sample: Sample) -> None:
        self._samples.append(sample)
        if sample.place is not None:
            self.axis_deg = float(self._columns[_AXIS, len(self._samples) - 1])
            self.walk.add(complex(*sample.place.position_m[:2]))

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


class Frames:
    """Frames `start` to `stop` of a log, of which the first `early` ones count for less: `weights` (n).

    `table` is what each showed in numbers (columns, n), see `evidence.ROW`.
    """

    __slots__ = ("early", "log", "start", "stop", "table", "weights")

    def __init__(self, log: FrameLog, start: int, stop: int, early: int = 0) -> None:
        self.log, self.start, self.stop, self.early = log, start, stop, early
        self.table = log.table[:, start:stop]
        self.weights = np.ones(stop - start)
        self.weights[:early] = EARLY_WEIGHT

    @staticmethod
    def of(samples: Sequence[Sample], early: int = 0) -> Frames:
        """These frames."""
        log = samples if isinstance(samples, FrameLog) else FrameLog(samples)
        return Frames(log, 0, len(log), early)

    @property
    def samples(self) -> list[Sample]:
        """The frames as they came."""
        return self.log[self.start : self.stop]

    @property
    def curves(self) -> Values:
        """The likelihoods of bearings of each (n, `BEARINGS`), 0 where it tells none."""
        return self.log.curves[self.start : self.stop]

    @property
    def weight(self) -> float:
        """How much they count together."""
        return self.weight_of(0, len(self))

    def weight_of(self, start: int, stop: int) -> float:
        """How much some of them count together."""
        return stop - start - (1 - EARLY_WEIGHT) * min(max(self.early - start, 0), stop - start)

    def totals(self, weights: Values | None = None) -> dict[str, float]:
        """How much those count together that show something, of each thing that is shown or not; or with other weights (n)."""
        of_flags = self.table[_FLAGGED] @ (self.weights if weights is None else weights)
        return dict(zip(FLAGS, of_flags.tolist(), strict=True))

    def side_of(self, sides: tuple[str, str], totals: Mapping[str, float], weights: Values) -> Side | None:
        """Left or right by the flags of these names, whichever counts for more; of as much, the one that came first."""
        left, right = (totals[name] for name in sides)
        if left > 0 and abs(left - right) < ROUNDING:
            came = ((self.column(name) * weights).argmax() for name in sides)
            return min(zip(came, SIDES, strict=True))[1]
        return SIDES[left < right] if left or right else None

    def show(self, name: str) -> Flags:
        """Which frames show something (n)."""
        return self.column(name) > 0

    def tells(self, name: str) -> Flags:
        """Which frames tell one of the numbers (n)."""
        return ~np.isnan(self.column(name))

    def column(self, name: str) -> Values:
        """One of the numbers, of each frame (n); not a number where a frame does not tell."""
        column: Values = self.table[ROW[name]]
        return column

    def __len__(self) -> int:
        return self.stop - self.start

    def __getitem__(self, part: slice) -> Frames:
        """Consecutive frames."""
        start, stop, _ = part.indices(len(self))
        early = min(max(self.early - start, 0), stop - start)
        return Frames(self.log, self.start + start, self.start + stop, early)

    def placed(self) -> Frames:
        """Those of a whole log of which is known where the person stood."""
        log = self.log.placed()
        return self if log is self.log else Frames.of(log, int(np.count_nonzero(self.tells("axis_deg")[: self.early])))

    def turns_to(self, axis_deg: float | None) -> Values:
        """What is added to bearings of each frame (n), to have them from the direction `axis_deg` in the map; degrees, but for
        full turns.

        0 without that direction, and in frames of which is not known where the person stood.
        """
        if axis_deg is None:
            return np.zeros(len(self))
        last_deg = self.log.axis_deg
        turns: Values = self.table[ROW["axis_deg"]] - (last_deg + wrapped_deg(axis_deg - last_deg))
        if len(self.log.walk) < len(self.log):
            turns[np.isnan(turns)] = 0.0
        return turns


def wrapped(angles_deg: Values) -> Values:
    """The same angles within -180 and 180 degrees."""
    return np.asarray((angles_deg + FULL_TURN_DEG / 2) % FULL_TURN_DEG - FULL_TURN_DEG / 2)
