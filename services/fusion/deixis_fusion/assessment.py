"""What is thought of one person at one frame, and from which evidence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from deixis_schemas.messages import Poi

from .decision import Judgement
from .evidence import Evidence
from .localisation import PersonPlace


class Assessment(NamedTuple):
    """What is thought of one person at one frame. `judgement` is none where no POI comes into question.

    `pois` are all there are; `doubt` says why the robot may have stood elsewhere, if so.
    """

    place: PersonPlace | None
    evidence: Evidence
    judgement: Judgement | None
    pois: Sequence[Poi]
    doubt: str = ""

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
