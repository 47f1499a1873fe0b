"""What one person sees: the frame of discernment X (eq. 10) as arrays, each POI with the bearings that it may have.

Where the person stands is known but for the distance from the camera, and what of a POI is meant but for its extent. Both are
one unknown for hand and head together: so bearings are computed for a few equally likely cases, the same ones for both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import NamedTuple, overload

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import Poi

from .localisation import PersonPlace
from .visibility import Candidate, Walls

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

# With a distance known to a tenth, the bearing of a POI 0.6 m from the person goes in steps of 4 degrees, the sigma of a head;
# that of farther ones in smaller steps.
CASES = 15
_SHARES = (np.arange(CASES) + 0.5) / CASES
_QUANTILES = np.array([NormalDist().inv_cdf(share) for share in _SHARES])
# Their middles have less variance than the distribution that they stand for.
DISTANCE_ERRORS: Values = _QUANTILES / _QUANTILES.std()
# Across a POI, spread so that no part of it goes with one distance (multiples of the golden ratio).
ACROSS: Values = (np.arange(CASES) * (math.sqrt(5) - 1) / 2) % 1 - 0.5
LEAST_AWAY_M = 0.05
WIDEST_SIGMA_DEG = 60.0
# Sight lines are looked along anew where the person has moved by more: less than what hangs on a wall stands off it.
HELD_M = 0.02


class Points(NamedTuple):
    """POIs as arrays: positions in the map (n, 2) and sizes across (n), metres."""

    pois: Sequence[Poi]
    xy: Values
    extent: Values

    @staticmethod
    def of(pois: Sequence[Poi]) -> Points:
        """The POIs in their order."""
        xy = np.array([poi.position_m[:2] for poi in pois], dtype=np.float64).reshape(-1, 2)
        return Points(pois, xy, np.array([poi.extent_m for poi in pois], dtype=np.float64))


class Bearings(NamedTuple):
    """Of n POIs at the person: the likeliest (n), its standard deviation (n), and those of the cases (CASES, n), degrees."""

    likeliest: Values
    sigma: Values
    cases: Values


@dataclass(frozen=True, eq=False)
class Sight(Sequence[Candidate]):
    """The POIs in question and their bearings. `points` and `chosen` (which of them are in sight) allow for other places."""

    bearings: Bearings
    points: Points
    chosen: Indices

    @staticmethod
    def of(candidates: Sequence[Candidate]) -> Sight:
        """Of POIs of which bearings alone are known: their sigma is taken for one of a normal distribution."""
        if isinstance(candidates, Sight):
            return candidates
        likeliest = np.array([candidate.bearing_deg for candidate in candidates], dtype=np.float64)
        sigma = np.array([candidate.bearing_sigma_deg for candidate in candidates], dtype=np.float64)
        bearings = Bearings(likeliest, sigma, likeliest + DISTANCE_ERRORS[:, None] * sigma)
        points = Points([candidate.poi for candidate in candidates], np.zeros((len(sigma), 2)), np.zeros(len(sigma)))
        return Sight(bearings, points, np.arange(len(sigma)))

    def seen_from(self, place: PersonPlace) -> Bearings:
        """The bearings of the same POIs from another place."""
        return bearings_from(place, self.points, self.chosen)

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


class Lookout:
    """The POIs in sight of one person, from frame to frame. Sight lines are kept while the person stands still."""

    def __init__(self, clearance_m: float) -> None:
        """`clearance_m`: the last part of a sight line, where walls do not count."""
        self._clearance_m = clearance_m
        self._kept: tuple[Points, Walls] | None = None
        self._eye = (0.0, 0.0)
        self._hidden: Flags = np.zeros(0, dtype=np.bool_)
        self._index: Indices = np.zeros(0, dtype=np.intp)

    @property
    def hidden(self) -> Flags:
        """Which of the POIs a wall hid when last looked for."""
        return self._hidden

    def look(self, place: PersonPlace, points: Points, walls: Walls) -> Sight:
        """What is in sight from there."""
        eye = (place.position_m[0], place.position_m[1])
        same = self._kept is not None and self._kept[0] is points and self._kept[1] is walls
        if not same or math.dist(eye, self._eye) > HELD_M:
            self._hidden = walls.hide(eye, points.xy, self._clearance_m)
            self._index = np.flatnonzero(~self._hidden)
            self._kept, self._eye = (points, walls), eye
        return Sight(bearings_from(place, points, self._index), points, self._index)


def bearings_from(place: PersonPlace, points: Points, index: Indices) -> Bearings:
    """Bearings of these POIs at the person, of the likeliest case and of all.

    From the direction person -> camera, counter-clockwise from above (REP-103). In all cases the person stands on the line
    through camera and head, which the picture tells well; how far along it, is known to `place.sigma_m`.
    """
    camera = complex(*place.camera_m[:2])
    ray = complex(*place.position_m[:2]) - camera
    targets = points.xy[index] @ np.array([1, 1j]) - camera
    # All turned so that the person sees the camera at 0.
    turn = -abs(ray) / ray if ray else 1.0
    targets, distance = targets * turn, abs(ray)
    relative = place.sigma_m / place.distance_m if place.distance_m > 0 else 0.0
    extent = points.extent[index]
    from_likeliest = targets + distance
    likeliest = np.degrees(np.angle(from_likeliest))
    away = np.maximum(np.abs(from_likeliest), LEAST_AWAY_M)
    across = np.hypot(place.sigma_m * from_likeliest.imag / away, extent / math.sqrt(12))
    sigma = np.minimum(WIDEST_SIGMA_DEG, np.degrees(np.arctan2(across, away)))
    steps = distance * np.exp(relative * DISTANCE_ERRORS)
    of_cases = targets + steps[:, None]
    # The angle of a part of the POI, for small angles; a POI that one stands in lies anywhere.
    aside = np.degrees(ACROSS[:, None] * np.minimum(extent / away, math.pi / 2))
    return Bearings(likeliest, sigma, np.degrees(np.angle(of_cases)) + aside)
