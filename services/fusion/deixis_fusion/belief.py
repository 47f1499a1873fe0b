"""Basic belief assignments over a frame of discernment and Dempster's rule (Pateraki et al. 2011, section 6, eqs 10-15)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

# Below this, what the sources agree on is rounding noise, and eq. 14 would divide by it.
TOTAL_CONFLICT = 1e-12
# What masses, and their sum, may be off by.
MOST_MASS = 1 + 1e-9
ROUNDING = 1e-6


@dataclass(frozen=True)
class BeliefAssignment:
    """A basic belief assignment m: 2^X -> [0, 1] over `size` hypotheses, numbered from 0.

    `masses` maps a set, as a bit mask (bit i stands for hypothesis i), to its mass. Sets not in it have mass 0. The empty
    set is never in it (eq. 11) and the masses sum to 1 (eq. 12).
    """

    size: int
    masses: Mapping[int, float]

    def __post_init__(self) -> None:
        """Raises ValueError where the masses break eqs 11 and 12."""
        if self.size < 1:
            raise ValueError("size: a frame of discernment needs at least one hypothesis")
        everything, masses = everything_of(self.size), self.masses
        if not (
            masses
            and min(masses) > 0
            and max(masses) <= everything
            and min(masses.values()) >= 0
            and max(masses.values()) <= MOST_MASS
            and abs(math.fsum(masses.values()) - 1) <= ROUNDING
        ):
            self._complain(everything)

    def _complain(self, everything: int) -> None:
        """Say what is wrong; a loop in Python, which all assignments that are right are spared."""
        for subset, mass in self.masses.items():
            if subset <= 0 or subset > everything:
                raise ValueError(f"masses: {subset:#x} is not a non-empty set of {self.size} hypotheses")
            if not 0 <= mass <= MOST_MASS:
                raise ValueError(f"masses: the mass of {subset:#x} is {mass}, not within 0 and 1")
        raise ValueError(f"masses: they sum to {math.fsum(self.masses.values())}, not to 1")

    @property
    def unknown(self) -> float:
        """m(X): the mass of the whole frame, which says nothing."""
        return self.masses.get(everything_of(self.size), 0.0)

    def belief(self, subset: int) -> float:
        """Bel(A): the mass of all sets within A."""
        return _share(mass for focal, mass in self.masses.items() if focal & ~subset == 0)

    def plausibility(self, subset: int) -> float:
        """Pl(A): the mass of all sets that meet A."""
        return _share(mass for focal, mass in self.masses.items() if focal & subset)

    def singletons(self) -> list[float]:
        """m({i}) for each hypothesis i, which is its belief too."""
        return [self.masses.get(1 << i, 0.0) for i in range(self.size)]

    def plausibilities(self) -> list[float]:
        """Pl({i}) for each hypothesis i."""
        sums = [0.0] * self.size
        for focal, mass in self.masses.items():
            for i in members(focal):
                sums[i] += mass
        return [min(value, 1.0) for value in sums]

    def pignistic(self) -> list[float]:
        """BetP({i}) for each hypothesis i: every set's mass shared equally among its members (Smets). Sums to 1."""
        sums = [0.0] * self.size
        for focal, mass in self.masses.items():
            part = mass / focal.bit_count()
            for i in members(focal):
                sums[i] += part
        return sums

    def discounted(self, rate: float) -> BeliefAssignment:
        """Shafer's discounting: keep 1 - rate of every mass, give `rate` to the whole frame."""
        if not 0 <= rate <= 1:
            raise ValueError(f"rate: {rate} is not within 0 and 1")
        everything = everything_of(self.size)
        kept = {subset: mass * (1 - rate) for subset, mass in self.masses.items() if subset != everything}
        kept[everything] = max(0.0, 1.0 - math.fsum(kept.values()))
        return BeliefAssignment(self.size, kept)


@dataclass(frozen=True)
class Combination:
    """Sources combined: their common belief, and the conflict mass 1 - K that Dempster's rule divides away.

    With total conflict (K = 0, which eq. 15 leaves undefined) `belief` is vacuous and `conflict` is 1.
    """

    belief: BeliefAssignment
    conflict: float


def everything_of(size: int) -> int:
    """The whole frame X as a bit mask."""
    return (1 << size) - 1


def members(subset: int) -> Iterator[int]:
    """The hypotheses of a set, ascending."""
    while subset:
        lowest = subset & -subset
        yield lowest.bit_length() - 1
        subset ^= lowest


def as_set(hypotheses: Iterable[int]) -> int:
    """The bit mask of these hypotheses."""
    mask = 0
    for i in hypotheses:
        mask |= 1 << i
    return mask


def vacuous(size: int) -> BeliefAssignment:
    """Total ignorance: m(X) = 1."""
    return BeliefAssignment(size, {everything_of(size): 1.0})


def normalised(size: int, weights: Mapping[int, float]) -> BeliefAssignment:
    """The assignment proportional to these weights of sets; vacuous where they are all 0."""
    positive = {subset: weight for subset, weight in weights.items() if weight > 0 and subset}
    total = math.fsum(positive.values())
    if not total > 0 or not math.isfinite(total):
        return vacuous(size)
    return BeliefAssignment(size, {subset: weight / total for subset, weight in positive.items()})


def combine(first: BeliefAssignment, second: BeliefAssignment) -> Combination:
    """Dempster's rule of combination, eqs 13-15.

    Raises ValueError for assignments over frames of different size.
    """
    if first.size != second.size:
        raise ValueError(f"the frames differ: {first.size} and {second.size} hypotheses")
    joint = intersections(first.masses, second.masses)
    agreement = math.fsum(joint.values())
    if agreement < TOTAL_CONFLICT:
        return Combination(vacuous(first.size), 1.0)
    return Combination(normalised(first.size, joint), min(1.0, max(0.0, 1.0 - agreement)))


def intersections(first: Mapping[int, float], second: Mapping[int, float]) -> dict[int, float]:
    """Unnormalised masses of the non-empty intersections, the sum in eq. 14.

    A singleton meets another only when they are equal, so pairs of singletons are looked up, not tried: with n POIs that is
    n steps, not n squared.
    """
    joint: dict[int, float] = {}
    small, large = _split(first)
    other_small, other_large = _split(second)
    for subset, mass in small.items():
        met = other_small.get(subset, 0.0)
        for focal, other in other_large:
            if focal & subset:
                met += other
        if mass * met > 0:
            joint[subset] = mass * met
    for subset, mass in other_small.items():
        met = 0.0
        for focal, other in large:
            if focal & subset:
                met += other
        if mass * met > 0:
            joint[subset] = joint.get(subset, 0.0) + mass * met
    for subset, mass in large:
        for focal, other in other_large:
            both = subset & focal
            if both and mass * other > 0:
                joint[both] = joint.get(both, 0.0) + mass * other
    return joint


def _split(masses: Mapping[int, float]) -> tuple[dict[int, float], list[tuple[int, float]]]:
    """Singletons, and the larger sets."""
    single: dict[int, float] = {}
    compound: list[tuple[int, float]] = []
    for subset, mass in masses.items():
        if subset & (subset - 1):
            compound.append((subset, mass))
        else:
            single[subset] = mass
    return single, compound


def _share(masses: Iterable[float]) -> float:
    return min(1.0, math.fsum(masses))
