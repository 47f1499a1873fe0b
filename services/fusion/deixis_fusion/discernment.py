"""The frame of discernment X: the POIs that a person can see, each with its bearing (eq. 10)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from deixis_schemas.messages import Poi

from .localisation import PersonPlace, bearing_deg, bearing_sigma_deg
from .visibility import Wall, sees


@dataclass(frozen=True)
class Candidate:
    """A POI that the person may mean. The bearing is at the person, positive toward the person's own left; degrees."""

    poi: Poi
    bearing_deg: float
    bearing_sigma_deg: float


def candidates(place: PersonPlace, pois: Sequence[Poi], walls: Sequence[Wall], clearance_m: float) -> list[Candidate]:
    """The POIs in sight of a person, in the order of their ids."""
    eye = (place.position_m[0], place.position_m[1])
    return [
        Candidate(poi, bearing_deg(place, poi.position_m), bearing_sigma_deg(place, poi.position_m, poi.extent_m))
        for poi in sorted(pois, key=lambda poi: poi.poi_id)
        if sees(eye, (poi.position_m[0], poi.position_m[1]), walls, clearance_m)
    ]
