"""What is thought of one person at one frame, and from which evidence."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import Poi

from .decision import Judgement
from .evidence import Evidence
from .localisation import PersonPlace

Indices = npt.NDArray[np.intp]
NONE: Indices = np.zeros(0, dtype=np.intp)
BEHIND_A_WALL = "behind a wall"
ROBOT_BLIND = "behind a wall for the robot"


class Excluded(NamedTuple):
    """A POI that does not come into question, and why."""

    poi: Poi
    reason: str


class Assessment(NamedTuple):
    """What is thought of one person at one frame. `judgement` is none where no POI comes into question.

    `pois` are all there are; `doubt` says why the robot may have stood elsewhere, if so. `hidden` are the places in `pois` of
    those that the person cannot see for a wall, `robot_blind` of those that only the robot cannot see, where that counts.
    """

    place: PersonPlace | None
    evidence: Evidence
    judgement: Judgement | None
    pois: Sequence[Poi]
    doubt: str = ""
    hidden: Indices = NONE
    robot_blind: Indices = NONE

    @property
    def poi_ids(self) -> tuple[str, ...]:
        """The answer."""
        return self.judgement.poi_ids if self.judgement else ()

    @property
    def best(self) -> float:
        """Probability of the likeliest POI."""
        return float(self.judgement.chances.max()) if self.judgement else 0.0

    @property
    def conflict(self) -> float:
        """Conflict mass 1 - K."""
        return self.judgement.combination.conflict if self.judgement else 0.0

    @property
    def contour_conflict(self) -> float:
        """How much hand and head contradict each other."""
        return self.judgement.contour_conflict if self.judgement else 0.0

    @property
    def excluded_total(self) -> int:
        """How many POIs do not come into question."""
        return len(self.hidden) + len(self.robot_blind)

    @property
    def excluded(self) -> Iterator[Excluded]:
        """The POIs that do not come into question."""
        for why, places in ((BEHIND_A_WALL, self.hidden), (ROBOT_BLIND, self.robot_blind)):
            for i in places.tolist():
                yield Excluded(self.pois[i], why)

    def nearest_excluded(self, count: int) -> list[Excluded]:
        """The first of the POIs that do not come into question, the nearest to the person first."""
        if self.place is None or count == 0:
            return []
        here = self.place.position_m[:2]
        return heapq.nsmallest(count, self.excluded, key=lambda told: math.dist(here, told.poi.position_m[:2]))
