"""Which pictures of a moving board are kept: such as are sharp and show something new."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .boards import Board
from .sightings import Sighting

NEW_SHARE = 0.04
"""A picture is new where its corners lie so far from those of every other kept, on average, as a share of the width."""
STILL_SHARE = 0.004
"""A board that moved by more since the last picture is blurred, or read while the shutter rolled."""
MOST_KEPT = 80
"""OpenCV's fit takes time with the square of the pictures; more than these tell nothing new."""


@dataclass
class Album:
    """Pictures of one board, all of one size.

    only_new: keep only such as differ from all others. only_still: only such as hardly differ from the picture before.
    """

    board: Board
    only_new: bool
    only_still: bool
    kept: list[Sighting] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    _before: Sighting | None = None

    @property
    def full(self) -> bool:
        """Whether no more are kept."""
        return len(self.kept) >= MOST_KEPT

    def add(self, name: str, sighting: Sighting | None) -> bool:
        """Take in the next picture, with the board in it or without; whether it was kept. `refused` has why not, by name."""
        before, self._before = self._before, sighting
        why = self._why_not(sighting, before)
        if why or sighting is None:
            self.refused[name] = why
            return False
        self.kept.append(sighting)
        return True

    def _why_not(self, sighting: Sighting | None, before: Sighting | None) -> str:
        if sighting is None:
            return "no board found"
        if self.kept and sighting.size != self.kept[0].size:
            sizes = " x ".join(map(str, sighting.size)), " x ".join(map(str, self.kept[0].size))
            return f"of {sizes[0]} pixels, the first of {sizes[1]}: a lens is measured at one size"
        if self.full:
            return f"{MOST_KEPT} are kept already"
        if self.only_still and (before is None or moved(before, sighting) > STILL_SHARE):
            return "the board moves"
        if self.only_new and any(moved(other, sighting) < NEW_SHARE for other in self.kept):
            return "like one that is kept"
        return ""


def moved(one: Sighting, other: Sighting) -> float:
    """How far the corners that both pictures show lie apart, on average, as a share of the width; infinite without any."""
    _, mine, its = np.intersect1d(one.ids, other.ids, return_indices=True)
    if one.size != other.size or not len(mine):
        return float("inf")
    return float(np.linalg.norm(one.px[mine] - other.px[its], axis=1).mean() / one.size[0])
