"""Basic belief assignments as arrays: a vector of the masses of single hypotheses, and a few larger sets.

The same numbers as `belief.py` gives (a test holds both together), for frames of thousands of POIs: our rules leave mass on
single POIs, on the three regions of eq. 16, on nested sets and on the whole frame, and on intersections of these.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .belief import TOTAL_CONFLICT, BeliefAssignment, Combination, members

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]
Sets = list[tuple[Flags, float]]


class Focal(NamedTuple):
    """A set with mass: its members and the mass."""

    members: Indices | tuple[int]
    mass: float


@dataclass(frozen=True, eq=False)
class MassVector:
    """m({i}) of each hypothesis in `single` (n); of larger sets, each once: flags of `members` (k, n) and `masses` (k)."""

    single: Values
    members: Flags
    masses: Values

    @staticmethod
    def normalised(single: Values, sets: Iterable[tuple[Flags, float]] = ()) -> MassVector:
        """The assignment proportional to these weights; vacuous where all are 0. Equal sets are added up."""
        flags, weights = tuple(zip(*sets, strict=True)) or ((), ())
        sets_flags = np.array(flags, dtype=np.bool_).reshape(-1, len(single))
        return MassVector.weighed(single, sets_flags, np.array(weights, dtype=np.float64))

    @staticmethod
    def weighed(single: Values, sets: Flags, weights: Values) -> MassVector:
        """The same of sets as flags (k, n) with their weights (k)."""
        gathered, total = _gathered(single, sets, weights)
        return gathered.divided(total) if total > 0 and math.isfinite(total) else MassVector.vacuous(len(single))

    @staticmethod
    def vacuous(size: int) -> MassVector:
        """Total ignorance: m(X) = 1."""
        larger = int(size > 1)
        return MassVector(np.full(size, 1.0 - larger), np.ones((larger, size), dtype=np.bool_), np.ones(larger))

    @staticmethod
    def of(assignment: BeliefAssignment) -> MassVector:
        """The same assignment."""
        larger = {subset: mass for subset, mass in assignment.masses.items() if subset & (subset - 1)}
        flags = np.zeros((len(larger), assignment.size), dtype=np.bool_)
        for row, subset in zip(flags, larger, strict=True):
            row[list(members(subset))] = True
        return MassVector(np.array(assignment.singletons()), flags, np.array(list(larger.values()), dtype=np.float64))

    @property
    def size(self) -> int:
        """How many hypotheses there are."""
        return len(self.single)

    @property
    def sets(self) -> Sets:
        """The larger sets, each with its mass."""
        return list(zip(self.members, self.masses.tolist(), strict=True))

    @cached_property
    def sizes(self) -> Indices:
        """How many members each of the larger sets has (k)."""
        return np.asarray(np.add.reduce(self.members, axis=1))

    @cached_property
    def unknown(self) -> float:
        """m(X): the mass of the whole frame, which says nothing."""
        if self.size == 1:
            return float(self.single[0])
        of_sizes = zip(self.sizes.tolist(), self.masses.tolist(), strict=True)
        return math.fsum(mass for size, mass in of_sizes if size == self.size)

    def plausibilities(self) -> Values:
        """Pl({i}) of each hypothesis."""
        return np.minimum(self.single + self.masses @ self.members, 1.0)

    def pignistic(self) -> Values:
        """BetP({i}) of each hypothesis: every set's mass shared equally among its members (Smets). Sums to 1."""
        return np.asarray(self.single + (self.masses / self.sizes) @ self.members)

    def divided(self, total: float) -> MassVector:
        """All masses divided by their total."""
        return MassVector(self.single / total, self.members, self.masses / total)

    def discounted(self, rate: float) -> MassVector:
        """Shafer's discounting: keep 1 - rate of every mass, give `rate` to the whole frame."""
        everything = np.ones((1, self.size), dtype=np.bool_)
        sets, masses = np.concatenate([self.members, everything]), np.append(self.masses * (1 - rate), rate)
        return MassVector.weighed(self.single * (1 - rate), sets, masses)

    def largest(self, count: int) -> list[Focal]:
        """The sets of largest mass, single hypotheses among them."""
        single = self.single
        best: Sequence[int] = range(len(single))
        if len(single) > count:
            candidates = (single >= np.partition(single, -count)[-count]).nonzero()[0]
            best = candidates[(-single[candidates]).argsort(kind="stable")[:count]].tolist()
            single = single[best]
        found: list[tuple[float, int, int, Indices | tuple[int]]]
        found = [(-mass, 1, i, (i,)) for i, mass in zip(best, single.tolist(), strict=True)]
        for flags, mass in zip(self.members, self.masses.tolist(), strict=True):
            named = flags.nonzero()[0]
            found.append((-mass, len(named), int(named[0]), named))
        found.sort(key=itemgetter(0, 1, 2))
        return [Focal(named, -mass) for mass, _, _, named in found[:count] if mass < 0]


class Combined(NamedTuple):
    """Sources combined: their common belief, and the conflict mass 1 - K that Dempster's rule divides away."""

    belief: MassVector
    conflict: float

    @staticmethod
    def of(combination: Combination) -> Combined:
        """The same."""
        return Combined(MassVector.of(combination.belief), combination.conflict)


def combine(first: MassVector, second: MassVector) -> Combined:
    """Dempster's rule, eqs 13-15. Total conflict, which eq. 15 leaves undefined, gives vacuous belief and conflict 1."""
    for one, other in ((first, second), (second, first)):
        if one.unknown == 1.0:
            return Combined(other, 0.0)  # nobody pointed: ignorance beside what the head tells
    single = first.single * (second.single + second.masses @ second.members) + second.single * (first.masses @ first.members)
    sets = (first.members[:, None] & second.members).reshape(-1, first.size)
    joint, agreement = _gathered(single, sets, np.multiply.outer(first.masses, second.masses).ravel())
    if agreement < TOTAL_CONFLICT:
        return Combined(MassVector.vacuous(first.size), 1.0)
    return Combined(joint.divided(agreement), min(1.0, max(0.0, 1.0 - agreement)))


def _gathered(single: Values, sets: Flags, weights: Values) -> tuple[MassVector, float]:
    """These weights with equal sets added up, and their total. Sets without a member, or without weight, go."""
    larger: dict[bytes, float] = {}
    rows = []
    for i, (size, weight) in enumerate(zip(np.add.reduce(sets, axis=1).tolist(), weights.tolist(), strict=True)):
        if size == 1:
            single = single + weight * sets[i]
        elif size and weight > 0:
            key = sets[i].tobytes()
            if key not in larger:
                rows.append(i)
            larger[key] = larger.get(key, 0.0) + weight
    members = sets if len(rows) == len(sets) else sets[rows]
    return MassVector(single, members, np.array([*larger.values()])), float(np.add.reduce(single)) + sum(larger.values())
