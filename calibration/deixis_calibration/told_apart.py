"""Whether each POI is told apart from its neighbours: what was answered when it was pointed at."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

ENOUGH = 2 / 3
"""As `deixis rehearse` has it."""
Verdict = Literal["told apart", "tied", "confused", "not seen"]


@dataclass(frozen=True)
class Try:
    """Somebody pointed at poi_id; named is what was answered, none where no pointing was noticed."""

    poi_id: str
    named: tuple[str, ...] | None


@dataclass(frozen=True)
class Standing:
    """How one POI fared. alone: named alone; among: alone or tied; unseen: no pointing was noticed; instead: what was named
    otherwise, the most often first.
    """

    poi_id: str
    tries: int
    alone: int
    among: int
    unseen: int
    instead: tuple[str, ...]

    @property
    def verdict(self) -> Verdict:
        """In two thirds of the tries, in the words of a rehearsal."""
        if self.unseen > (1 - ENOUGH) * self.tries:
            return "not seen"
        if self.alone >= ENOUGH * self.tries:
            return "told apart"
        return "tied" if self.among >= ENOUGH * self.tries else "confused"


def standings(tries: Sequence[Try]) -> list[Standing]:
    """Of each POI that was tried, in the order of the tries."""
    return [
        _standing(poi_id, [one for one in tries if one.poi_id == poi_id]) for poi_id in dict.fromkeys(t.poi_id for t in tries)
    ]


def _standing(poi_id: str, tries: Sequence[Try]) -> Standing:
    answered = [one.named for one in tries if one.named is not None]
    others = Counter(name for named in answered for name in named if name != poi_id)
    return Standing(
        poi_id,
        len(tries),
        sum(named == (poi_id,) for named in answered),
        sum(poi_id in named for named in answered),
        len(tries) - len(answered),
        tuple(name for name, _ in others.most_common()),
    )
