"""Basic belief assignments as arrays: a vector of the masses of single hypotheses, and a few larger sets.

The same numbers as `belief.py` gives (a test holds both together), for frames of thousands of POIs: our rules leave mass on
single POIs, on the three regions of eq. 16, on nested sets and on the whole frame, and on intersections of these.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .belief import TOTAL_CONFLICT, BeliefAssignment, Combination, members

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]
Sets = Sequence[tuple[Flags, float]]


class Focal(NamedTuple):
    """A set with mass: its members and the mass."""

    members: Indices
    mass: float


@dataclass(frozen=True, eq=False)
class MassVector:
    """m({i}) of each hypothesis in `single`; `sets` holds each larger set once, as flags of its members, with its mass."""

    single: Values
    sets: Sets = ()

    @staticmethod
    def normalised(single: Values, sets: Iterable[tuple[Flags, float]] = ()) -> MassVector:
        """The assignment proportional to these weights; vacuous where all are 0. Equal sets are added up."""
        vector, larger = single.copy(), dict[bytes, tuple[Flags, float]]()
        for flags, weight in sets:
            count = int(np.count_nonzero(flags))
            if count == 1:
                vector[flags] += weight
            elif count and weight > 0:
                larger[flags.tobytes()] = (flags, larger.get(flags.tobytes(), (flags, 0.0))[1] + weight)
        total = float(vector.sum()) + sum(weight for _, weight in larger.values())
        if not (total > 0 and np.isfinite(total)):
            return MassVector.vacuous(len(single))
        return MassVector(vector / total, [(flags, weight / total) for flags, weight in larger.values()])

    @staticmethod
    def vacuous(size: int) -> MassVector:
        """Total ignorance: m(X) = 1."""
        return MassVector(np.ones(1)) if size == 1 else MassVector(np.zeros(size), [(np.ones(size, dtype=np.bool_), 1.0)])

    @staticmethod
    def of(assignment: BeliefAssignment) -> MassVector:
        """The same assignment."""
        sets = []
        for subset, mass in assignment.masses.items():
            if subset & (subset - 1):
                flags = np.zeros(assignment.size, dtype=np.bool_)
                flags[list(members(subset))] = True
                sets.append((flags, mass))
        return MassVector(np.array(assignment.singletons()), sets)

    @property
    def size(self) -> int:
        """How many hypotheses there are."""
        return len(self.single)

    @property
    def unknown(self) -> float:
        """m(X): the mass of the whole frame, which says nothing."""
        if self.size == 1:
            return float(self.single[0])
        return sum(mass for flags, mass in self.sets if flags.all())

    def plausibilities(self) -> Values:
        """Pl({i}) of each hypothesis."""
        sums = self.single.copy()
        for flags, mass in self.sets:
            sums[flags] += mass
        return np.minimum(sums, 1.0)

    def pignistic(self) -> Values:
        """BetP({i}) of each hypothesis: every set's mass shared equally among its members (Smets). Sums to 1."""
        sums = self.single.copy()
        for flags, mass in self.sets:
            sums[flags] += mass / np.count_nonzero(flags)
        return sums

    def discounted(self, rate: float) -> MassVector:
        """Shafer's discounting: keep 1 - rate of every mass, give `rate` to the whole frame."""
        kept = [(flags, mass * (1 - rate)) for flags, mass in self.sets]
        return MassVector.normalised(self.single * (1 - rate), [*kept, (np.ones(self.size, dtype=np.bool_), rate)])

    def mixed(self, other: MassVector, share: float) -> MassVector:
        """`share` of this one, the rest of the other."""
        own = [(flags, mass * share) for flags, mass in self.sets]
        theirs = [(flags, mass * (1 - share)) for flags, mass in other.sets]
        return MassVector.normalised(share * self.single + (1 - share) * other.single, [*own, *theirs])

    def largest(self, count: int) -> list[Focal]:
        """The sets of largest mass, single hypotheses among them."""
        found = [Focal(np.flatnonzero(flags), mass) for flags, mass in self.sets if mass > 0]
        best = np.argsort(-self.single, kind="stable")[:count]
        found += [Focal(np.array([i]), float(self.single[i])) for i in best if self.single[i] > 0]
        return sorted(found, key=lambda focal: (-focal.mass, len(focal.members), focal.members[0]))[:count]


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
    single = first.single * second.single
    for flags, mass in second.sets:
        single[flags] += first.single[flags] * mass
    for flags, mass in first.sets:
        single[flags] += second.single[flags] * mass
    sets = [(flags & others, mass * other) for flags, mass in first.sets for others, other in second.sets]
    agreement = float(single.sum()) + sum(mass for flags, mass in sets if flags.any())
    if agreement < TOTAL_CONFLICT:
        return Combined(MassVector.vacuous(first.size), 1.0)
    return Combined(MassVector.normalised(single, sets), min(1.0, max(0.0, 1.0 - agreement)))
