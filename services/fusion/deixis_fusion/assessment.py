"""What is thought of one person at one frame, and from which evidence."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import Poi

from .decision import Judgement
from .evidence import Evidence
from .localisation import PersonPlace

Indices = npt.NDArray[np.intp]
NONE: Indices = np.zeros(0, dtype=np.intp)


class Assessment(NamedTuple):
    """What is thought of one person at one frame. `judgement` is none where no POI comes into question.

    `pois` are all there are; `doubt` says why the robot may have stood elsewhere, if so. `hidden` are the places in `pois` of
    those that the person cannot see for a wall.
    """

    place: PersonPlace | None
    evidence: Evidence
    judgement: Judgement | None
    pois: Sequence[Poi]
    doubt: str = ""
    hidden: Indices = NONE

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

    def nearest_hidden(self, count: int) -> list[Poi]:
        """The first of the POIs that a wall hides, the nearest to the person first."""
        if self.place is None or count == 0:
            return []
        here, hidden = self.place.position_m[:2], [self.pois[int(i)] for i in self.hidden]
        return heapq.nsmallest(count, hidden, key=lambda poi: math.dist(here, poi.position_m[:2]))
