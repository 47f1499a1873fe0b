"""Curves over time: how probable each POI is, the conflicts, and how late each stage's answer comes.

A curve belongs to a place among the people in sight, not to a person: visitors come all day, and a viewer holds few curves.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping

from deixis_cli import wording
from deixis_schemas.messages import Belief, PersonBelief, PoiBelief

from . import colours
from .drawing import CurveStyle, Drawing, Value

BELIEF, CONFLICT, LATENCY = "belief", "conflict", "latency"
WORTH_SAYING = 0.15
"""How probable a POI has to become to have a curve."""
MOST_CURVES = 40
"""Of POIs at a time: of a thousand POIs a picture with a thousand curves says nothing."""


class Curves:
    """Points of the curves of one frame after the other; a curve is named when it begins."""

    def __init__(self) -> None:
        # The POIs' by their last point, the oldest first; of the others there are a few for each person in sight.
        self._of_pois: OrderedDict[str, None] = OrderedDict()
        self._others: dict[str, None] = {}
        self._began = {BELIEF: 0, CONFLICT: 0, LATENCY: 0}
        self._places: dict[int, int] = {}

    def of_belief(self, belief: Belief, names: Mapping[str, str]) -> Iterator[Drawing]:
        """How probable the POIs are meant, and the conflicts. A POI has a curve from when it is worth saying."""
        self._take_places([person.person_id for person in belief.persons])
        for person in belief.persons:
            place = self._places[person.person_id]
            for poi in person.pois:
                yield from self._of_poi(place, poi, names)
            yield from self._conflicts(place, person)

    def of_latency(self, latencies_ms: Mapping[str, float]) -> Iterator[Drawing]:
        """From capture until each stage's answer was heard, milliseconds, by stage."""
        for stage, latency_ms in latencies_ms.items():
            yield from self._point(LATENCY, f"{LATENCY}/{stage}", stage, latency_ms)

    def _take_places(self, present: list[int]) -> None:
        """Who is in sight keeps the place; who comes takes the first that is free."""
        self._places = {person_id: place for person_id, place in self._places.items() if person_id in present}
        for person_id in present:
            if person_id not in self._places:
                free = set(range(len(present) + 1)) - set(self._places.values())
                self._places[person_id] = min(free)

    def _of_poi(self, place: int, poi: PoiBelief, names: Mapping[str, str]) -> Iterator[Drawing]:
        path, chance = f"{BELIEF}/{place}/{poi.poi_id}", wording.chance(poi)
        if path not in self._of_pois:
            if chance < WORTH_SAYING:
                return
            if len(self._of_pois) >= MOST_CURVES:
                self._of_pois.popitem(last=False)
            yield self._style(BELIEF, path, wording.titled(poi.poi_id, names) + _whose(place))
        self._of_pois[path] = None
        self._of_pois.move_to_end(path)
        yield Drawing(path, Value(chance))

    def _conflicts(self, place: int, person: PersonBelief) -> Iterator[Drawing]:
        for what, name, value in (
            ("dempster", "Dempster's", person.conflict),
            ("contour", "of hand and head", person.contour_conflict),
            ("unknown", "not known", person.unknown),
        ):
            yield from self._point(CONFLICT, f"{CONFLICT}/{place}/{what}", name + _whose(place), value)

    def _point(self, group: str, path: str, name: str, value: float) -> Iterator[Drawing]:
        if path not in self._others:
            self._others[path] = None
            yield self._style(group, path, name)
        yield Drawing(path, Value(value))

    def _style(self, group: str, path: str, name: str) -> Drawing:
        colour = colours.CURVES[self._began[group] % len(colours.CURVES)]
        self._began[group] += 1
        return Drawing(path, CurveStyle(name, colour))


def _whose(place: int) -> str:
    """Whose it is, where several people are in sight."""
    return f", person no. {place + 1}" if place else ""
