"""Which pictures of a moving board are kept: such as are sharp and show something new, of the size that most have."""

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
    """Pictures of one board. A lens is measured at one size: the one that most of them have, of several the largest.

    only_new: keep only such as differ from all others. only_still: only such as hardly differ from the picture before.
    """

    board: Board
    only_new: bool
    only_still: bool
    _by_size: dict[tuple[int, int], list[Sighting]] = field(default_factory=dict)
    _refused: dict[str, str] = field(default_factory=dict)
    _before: Sighting | None = None

    @property
    def kept(self) -> list[Sighting]:
        """The pictures to measure with, all of one size."""
        return max(self._by_size.values(), key=lambda kept: (len(kept), kept[0].size), default=[])

    @property
    def refused(self) -> dict[str, str]:
        """Why a picture is not used, by its name; pictures of other sizes are among them as long as they are fewer."""
        kept = self.kept
        others = [sighting for of_size in self._by_size.values() if of_size is not kept for sighting in of_size]
        return self._refused | {sighting.name: _of_other_size(sighting, kept[0]) for sighting in others}

    @property
    def full(self) -> bool:
        """Whether no more are kept."""
        return len(self.kept) >= MOST_KEPT

    def add(self, name: str, sighting: Sighting | None) -> bool:
        """Take in the next picture, with the board in it or without; whether it was kept. `refused` has why not, by name."""
        before, self._before = self._before, sighting
        why = self._why_not(sighting, before)
        if why or sighting is None:
            self._refused[name] = why
            return False
        self._by_size.setdefault(sighting.size, []).append(sighting)
        return True

    def refuse(self, name: str, why: str) -> None:
        """Note a picture that could not be looked at."""
        self._refused[name] = why

    def _why_not(self, sighting: Sighting | None, before: Sighting | None) -> str:
        if sighting is None:
            return "no board found"
        like_it = self._by_size.get(sighting.size, [])
        if len(like_it) >= MOST_KEPT:
            return f"{MOST_KEPT} are kept already"
        if self.only_still and (before is None or moved(before, sighting) > STILL_SHARE):
            return "the board moves"
        if self.only_new and any(moved(other, sighting) < NEW_SHARE for other in like_it):
            return "like one that is kept"
        return ""


def _of_other_size(sighting: Sighting, used: Sighting) -> str:
    sizes = " x ".join(map(str, sighting.size)), " x ".join(map(str, used.size))
    return f"of {sizes[0]} pixels, most of {sizes[1]}: a lens is measured at one size"


def moved(one: Sighting, other: Sighting) -> float:
    """How far the corners that both pictures show lie apart, on average, as a share of the width; infinite without any."""
    _, mine, its = np.intersect1d(one.ids, other.ids, return_indices=True)
    if one.size != other.size or not len(mine):
        return float("inf")
    return float(np.linalg.norm(one.px[mine] - other.px[its], axis=1).mean() / one.size[0])
