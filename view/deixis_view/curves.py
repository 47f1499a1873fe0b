"""Curves over time: how probable each POI is, the conflicts, and how late each stage's answer comes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from deixis_cli import wording
from deixis_schemas.messages import Belief, PersonBelief, PoiBelief

from . import colours
from .drawing import CurveStyle, Drawing, Value

BELIEF, CONFLICT, LATENCY = "belief", "conflict", "latency"
WORTH_SAYING = 0.15
"""How probable a POI has to become to have a curve."""
MOST_CURVES = 40
"""Of POIs, of all people together: of a thousand POIs a picture with a thousand curves says nothing."""


class Curves:
    """Points of the curves of one frame after the other; a curve is named when it begins."""

    def __init__(self) -> None:
        self._begun: dict[str, int] = {}
        self._pois = 0

    def of_belief(self, belief: Belief, names: Mapping[str, str]) -> Iterator[Drawing]:
        """How probable the POIs are meant, and the conflicts. A POI has a curve from when it is worth saying."""
        for person in belief.persons:
            for poi in person.pois:
                yield from self._of_poi(person, poi, names)
            whose = f"person {person.person_id}"
            yield from self._point(f"{CONFLICT}/{person.person_id}/dempster", f"Dempster's, {whose}", person.conflict)
            yield from self._point(f"{CONFLICT}/{person.person_id}/contour", f"hand and head, {whose}", person.contour_conflict)
            yield from self._point(f"{CONFLICT}/{person.person_id}/unknown", f"not known, {whose}", person.unknown)

    def of_latency(self, latencies_ms: Mapping[str, float]) -> Iterator[Drawing]:
        """From capture until each stage's answer was heard, milliseconds, by stage."""
        for stage, latency_ms in latencies_ms.items():
            yield from self._point(f"{LATENCY}/{stage}", stage, latency_ms)

    def _of_poi(self, person: PersonBelief, poi: PoiBelief, names: Mapping[str, str]) -> Iterator[Drawing]:
        path, chance = f"{BELIEF}/{person.person_id}/{poi.poi_id}", wording.chance(poi)
        if path not in self._begun:
            if chance < WORTH_SAYING or self._pois >= MOST_CURVES:
                return
            self._pois += 1
        whose = f", person {person.person_id}" if person.person_id else ""
        yield from self._point(path, f"{wording.titled(poi.poi_id, names)}{whose}", chance)

    def _point(self, path: str, name: str, value: float) -> Iterator[Drawing]:
        if path not in self._begun:
            if len(self._begun) >= 4 * MOST_CURVES:
                return
            group = path.split("/", 1)[0]
            nth = sum(begun.startswith(group) for begun in self._begun)
            self._begun[path] = nth
            yield Drawing(path, CurveStyle(name, colours.CURVES[nth % len(colours.CURVES)]))
        yield Drawing(path, Value(value))
