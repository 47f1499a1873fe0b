"""Figure 6 as a function: how likely a head is read as which yaw when it is turned to a bearing, with its sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .confusion import HeadConfusion

Values = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PerceivedYaw:
    """P(perceived yaw | bearing), degrees: `shares` (r + 1, c) has a row for each of `yaw_deg` (r), the last is "not computed";
    and a column for each of `bearing_deg` (c), -180 to 180, between which it goes on a line.
    """

    yaw_deg: Values
    bearing_deg: Values
    shares: Values

    @staticmethod
    def of(confusion: HeadConfusion) -> PerceivedYaw:
        """The figure gives sizes: a head is read on the side to which it is turned; ahead, either side is as likely."""
        sizes, columns = np.array(confusion.perceived_deg), np.array(confusion.intended_deg)
        table = np.array(confusion.table) / np.sum([*confusion.table, confusion.not_computed], axis=0)
        rows, middle = len(sizes), len(sizes) - 1
        left = np.zeros((2 * rows, len(columns)))
        left[middle:-1, 1:] = table[:, 1:]
        left[middle:-1, 0] = np.concatenate([table[:1, 0], table[1:, 0] / 2])
        left[:middle, 0] = table[:0:-1, 0] / 2
        left[-1] = 1 - left[:-1].sum(axis=0)
        right = np.concatenate([left[-2::-1], left[-1:]])[:, :0:-1]
        return PerceivedYaw(
            yaw_deg=np.concatenate([-sizes[:0:-1], sizes]),
            bearing_deg=np.concatenate([-columns[:0:-1], columns]),
            shares=np.concatenate([right, left], axis=1),
        )

    def within(self, limit_deg: float) -> PerceivedYaw:
        """The same of a reader that computes no yaw beyond the limit."""
        kept = np.abs(self.yaw_deg) <= limit_deg
        computed = self.shares[:-1]
        unread = self.shares[-1] + computed[~kept].sum(axis=0)
        return PerceivedYaw(self.yaw_deg[kept], self.bearing_deg, np.concatenate([computed[kept], unread[None]]))

    def distributions(self, bearings_deg: Values) -> Values:
        """P(each row | bearing) (r + 1, ...) at bearings (...) within -180 and 180."""
        below, share = _place(self.bearing_deg, bearings_deg)
        low = self.shares[:, below]
        return np.asarray(low + share * (self.shares[:, below + 1] - low))

    def likelihoods(self, yaw_deg: float | None, bearings_deg: Values) -> Values:
        """P(this yaw, or not computed | bearing), of each bearing; a yaw between two rows is on a line between these."""
        told = self.distributions(bearings_deg)
        if yaw_deg is None:
            return np.asarray(told[-1])
        below, share = _place(self.yaw_deg, np.array(yaw_deg))
        return np.asarray((1 - share) * told[below] + share * told[below + 1])


def _place(grid: Values, at: Values) -> tuple[Indices, Values]:
    """The step of the grid in which each value lies, and how far along that; beyond the grid, its end."""
    below = np.clip(np.searchsorted(grid, at, "right") - 1, 0, len(grid) - 2)
    return below, np.clip((at - grid[below]) / (grid[below + 1] - grid[below]), 0.0, 1.0)
