"""What one person sees: the frame of discernment X (eq. 10) as arrays, each POI with the bearings that it may have.

Where the person stands is known but for the distance from the camera, and what of a POI is meant but for its extent. Both are
one unknown for hand and head together: so bearings are computed for a few equally likely cases, the same ones for both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import NamedTuple, overload

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import Poi

from .localisation import PersonPlace
from .visibility import Candidate, Walls

Values = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Indices = npt.NDArray[np.intp]

# With a distance known to a tenth, the bearing of a POI 0.6 m from the person goes in steps of 4 degrees, the sigma of a head;
# that of farther ones in smaller steps.
CASES = 15
# Enough for POIs whose bearing is known to `FEW_BELOW_DEG`: they go in steps of 3 degrees then.
FEW_CASES = 5
FEW_BELOW_DEG = 4.0


def _distance_errors(count: int) -> Values:
    """So many equally likely values of a standard normal distribution."""
    middles = np.array([NormalDist().inv_cdf((i + 0.5) / count) for i in range(count)])
    # Middles have less variance than the distribution that they stand for.
    return np.asarray(middles / middles.std())


def _across(count: int) -> Singles:
    """So many places across a POI, spread so that no part of it goes with one distance (multiples of the golden ratio)."""
    return ((np.arange(count) * (math.sqrt(5) - 1) / 2) % 1 - 0.5).astype(np.float32)


DISTANCE_ERRORS = _distance_errors(CASES)
ERRORS = {count: (_distance_errors(count), _across(count)) for count in (CASES, FEW_CASES)}
LEAST_AWAY_M = 0.05
WIDEST_SIGMA_DEG = 60.0
# Sight lines are looked along anew where the person has moved by more: less than what hangs on a wall stands off it.
HELD_M = 0.02
# Places from which bearings are kept: those of a walk, until its parts are others.
KEPT_PLACES = 64


class Points(NamedTuple):
    """POIs as arrays: positions in the map (n, 2), with height (n, 3), and sizes across (n), metres."""

    pois: Sequence[Poi]
    xyz: Values
    extent: Values

    @property
    def xy(self) -> Values:
        """Positions seen from above."""
        return self.xyz[:, :2]

    @staticmethod
    def of(pois: Sequence[Poi]) -> Points:
        """The POIs in their order."""
        xyz = np.array([poi.position_m for poi in pois], dtype=np.float64).reshape(-1, 3)
        return Points(pois, xyz, np.array([poi.extent_m for poi in pois], dtype=np.float64))


class Bearings(NamedTuple):
    """Of n POIs at the person: the likeliest (n), its standard deviation (n), and those of the cases (CASES, n), degrees."""

    likeliest: Values
    sigma: Values
    cases: Singles


@dataclass(frozen=True, eq=False)
class Sight(Sequence[Candidate]):
    """The POIs in question and their bearings. `points` and `chosen` (which of them are in sight) allow for other places.

    `place` is where they are seen from; none where bearings alone are known. `kept` are their bearings in all cases from other
    places, as they are asked for.
    """

    bearings: Bearings
    points: Points
    chosen: Indices
    place: PersonPlace | None = None
    kept: dict[PersonPlace, Singles] = field(default_factory=dict)

    @staticmethod
    def of(candidates: Sequence[Candidate]) -> Sight:
        """Of POIs of which bearings alone are known: their sigma is taken for one of a normal distribution."""
        if isinstance(candidates, Sight):
            return candidates
        likeliest = np.array([candidate.bearing_deg for candidate in candidates], dtype=np.float64)
        sigma = np.array([candidate.bearing_sigma_deg for candidate in candidates], dtype=np.float64)
        cases = likeliest + DISTANCE_ERRORS[:, None] * sigma
        cases -= 360 * np.rint(cases / 360)
        bearings = Bearings(likeliest, sigma, cases.astype(np.float32))
        points = Points([candidate.poi for candidate in candidates], np.zeros((len(sigma), 3)), np.zeros(len(sigma)))
        return Sight(bearings, points, np.arange(len(sigma)))

    def cases_from(self, places: Sequence[PersonPlace], part: Indices | slice, count: int = CASES) -> Singles:
        """Bearings of a part of these POIs, or of all, in all cases (v, CASES, n): from where they are seen now or, in `count`
        cases, from these v places.
        """
        if not places:
            return self.bearings.cases[None, :, part]
        if isinstance(part, slice):
            return np.array([self._all_from(place) for place in places])
        return _cases(places, _Turned.of(places, self.points, self.chosen[part]), count)

    def _all_from(self, place: PersonPlace) -> Singles:
        """Of all in all cases, from there: of a walk only where the person stands now is new in each frame."""
        if place is self.place:
            return self.bearings.cases
        if place not in self.kept:
            self.kept[place] = _cases([place], _Turned.of([place], self.points, self.chosen), CASES)[0]
        return self.kept[place]

    def poi(self, i: int) -> Poi:
        """The i-th POI in sight."""
        return self.points.pois[int(self.chosen[i])]

    def __len__(self) -> int:
        return len(self.chosen)

    @overload
    def __getitem__(self, i: int) -> Candidate: ...
    @overload
    def __getitem__(self, i: slice) -> list[Candidate]: ...
    def __getitem__(self, i: int | slice) -> Candidate | list[Candidate]:
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        return Candidate(self.poi(i), float(self.bearings.likeliest[i]), float(self.bearings.sigma[i]))

    def __iter__(self) -> Iterator[Candidate]:
        return (self[i] for i in range(len(self)))


def ids_at(seen: Sequence[Candidate], chosen: Sequence[int] | Indices) -> list[str]:
    """The ids of some of the POIs that are seen; of a sight without candidates made for them."""
    if isinstance(seen, Sight):
        return [seen.points.pois[place].poi_id for place in seen.chosen[np.asarray(chosen, dtype=np.intp)].tolist()]
    return [seen[i].poi.poi_id for i in chosen]


def bearings_at(seen: Sequence[Candidate], chosen: Indices) -> list[float]:
    """The likeliest bearings of some of the POIs that are seen, degrees."""
    if isinstance(seen, Sight):
        bearings: list[float] = seen.bearings.likeliest[chosen].tolist()
        return bearings
    return [seen[i].bearing_deg for i in chosen.tolist()]


class Lookout:
    """The POIs in sight of one person, from frame to frame. Sight lines are kept while the person stands still."""

    def __init__(self, clearance_m: float) -> None:
        """`clearance_m`: the last part of a sight line, where walls do not count."""
        self._clearance_m = clearance_m
        self._kept: tuple[Points, Walls] | None = None
        self._eye = (0.0, 0.0)
        self._hidden: Indices = np.zeros(0, dtype=np.intp)
        self._index: Indices = np.zeros(0, dtype=np.intp)
        self._bearings: dict[PersonPlace, Singles] = {}

    @property
    def hidden(self) -> Indices:
        """Which of the POIs a wall hid when last looked for, as places in their order."""
        return self._hidden

    def look(self, place: PersonPlace, points: Points, walls: Walls) -> Sight:
        """What is in sight from there."""
        eye = (place.position_m[0], place.position_m[1])
        same = self._kept is not None and self._kept[0] is points and self._kept[1] is walls
        if not same or (len(walls) and math.dist(eye, self._eye) > HELD_M):
            hidden = walls.hide(eye, points.xy, self._clearance_m, points.extent / 2 + self._clearance_m)
            in_sight = np.flatnonzero(~hidden)
            if not same or not np.array_equal(in_sight, self._index):
                self._bearings = {}
            self._hidden, self._index = np.flatnonzero(hidden), in_sight
            self._kept, self._eye = (points, walls), eye
        if len(self._bearings) > KEPT_PLACES:
            self._bearings = {}
        return Sight(bearings_from(place, points, self._index), points, self._index, place, self._bearings)


class _Turned(NamedTuple):
    """POIs as seen from v places, turned so that each person sees the camera at 0: metres ahead and to the left of the camera,
    how far they are from the person (v, n) and across (n); the person's distance from the camera (v, 1).
    """

    ahead: Values
    left: Values
    away: Values
    extent: Values
    distance: Values

    @staticmethod
    def of(places: Sequence[PersonPlace], points: Points, index: Indices) -> _Turned:
        """These POIs for persons there."""
        camera_x, camera_y, cos, sin, distance = np.array([_axis(place) for place in places]).T[:, :, None]
        x, y, _ = points.xyz[index].T
        x, y = x - camera_x, y - camera_y
        ahead, left = cos * x + sin * y, cos * y - sin * x
        away = np.hypot(ahead + distance, left)
        np.maximum(away, LEAST_AWAY_M, out=away)
        return _Turned(ahead, left, away, points.extent[index], distance)


def _axis(place: PersonPlace) -> tuple[float, float, float, float, float]:
    """Where the camera is, the direction to it from the person as a unit vector, and how far away it is; seen from above."""
    (x, y), (eye_x, eye_y) = place.camera_m[:2], place.position_m[:2]
    distance = math.hypot(x - eye_x, y - eye_y)
    if distance <= 0:
        return x, y, 1.0, 0.0, 0.0
    return x, y, (x - eye_x) / distance, (y - eye_y) / distance, distance


def bearings_from(place: PersonPlace, points: Points, index: Indices) -> Bearings:
    """Bearings of these POIs at the person, of the likeliest case and of all.

    From the direction person -> camera, counter-clockwise from above (REP-103).
    """
    turned = _Turned.of([place], points, index)
    (left,), (ahead,), (away,), (distance,) = turned.left, turned.ahead, turned.away, turned.distance
    likeliest = np.arctan2(left, ahead + distance)
    likeliest *= math.degrees(1)
    sigma = np.arctan2(np.hypot(place.sigma_m * left / away, turned.extent / math.sqrt(12)), away)
    sigma *= math.degrees(1)
    np.minimum(sigma, WIDEST_SIGMA_DEG, out=sigma)
    return Bearings(likeliest, sigma, _cases([place], turned, CASES)[0])


def _cases(places: Sequence[PersonPlace], turned: _Turned, count: int) -> Singles:
    """Bearings from v places in so many cases, as `ERRORS` has them: (v, count, n).

    In each the person stands on the line through camera and head, which the picture tells well; how far along it, is known to
    `place.sigma_m`.
    In single precision, a hundred thousandth of a degree: half as many bytes, of the most there is to reckon.
    """
    errors, across = ERRORS[count]
    relative = np.array([place.sigma_m / place.distance_m if place.distance_m > 0 else 0.0 for place in places])
    steps = (turned.distance * np.exp(relative[:, None] * errors)).astype(np.float32)
    # The angle of a part of the POI, for small angles; a POI that one stands in lies anywhere.
    wide = np.degrees(np.minimum(turned.extent / turned.away, math.pi / 2)).astype(np.float32)
    bearings = turned.ahead.astype(np.float32)[:, None, :] + steps[:, :, None]
    np.arctan2(turned.left.astype(np.float32)[:, None, :], bearings, out=bearings)
    bearings *= np.float32(math.degrees(1))
    bearings += across[:, None] * wide[:, None, :]
    return bearings
