"""Rules that combine any number of sources. They differ in what becomes of conflict, the products of sets that do not meet.

* Dempster (the paper's, eqs 13-15) divides it away; Yager 1987 gives it to the whole frame; Dubois and Prade 1988 give each
  conflicting product to the union of its sets; PCR6 (Martin and Osswald 2006) back to its sets, in proportion to their masses.
* Dempster's alone is associative, so all rules take the sources together. The order of these never matters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Literal

from .belief import BeliefAssignment, Combination, combine, everything_of, intersections, normalised

RuleName = Literal["dempster", "yager", "dubois_prade", "pcr6"]
Rule = Callable[[Sequence[BeliefAssignment]], Combination]

MOST_PRODUCTS = 1_000_000
"""Of focal sets, one of each source: their number grows with the power of the number of sources."""


def dempster(sources: Sequence[BeliefAssignment]) -> Combination:
    """Dempster's rule. With total conflict, which eq. 15 leaves undefined, vacuous and flagged: `conflict` is 1.

    Raises ValueError for no source, and for frames of different size, as all rules do.
    """
    _check(sources)
    belief, agreement = sources[0], 1.0
    for source in sources[1:]:
        step = combine(belief, source)
        if step.conflict >= 1.0:
            return step
        belief, agreement = step.belief, agreement * (1.0 - step.conflict)
    return Combination(belief, 1.0 - agreement)


def yager(sources: Sequence[BeliefAssignment]) -> Combination:
    """Yager's rule: conflict is ignorance. Raises ValueError."""
    _check(sources)
    size, met = sources[0].size, dict(sources[0].masses)
    for source in sources[1:]:
        met = intersections(met, source.masses)
    conflict = _share(1.0 - math.fsum(met.values()))
    met[everything_of(size)] = met.get(everything_of(size), 0.0) + conflict
    return Combination(normalised(size, met), conflict)


def dubois_prade(sources: Sequence[BeliefAssignment]) -> Combination:
    """Dubois and Prade's rule: of sources that contradict each other, one is right, and nobody knows which.

    Raises ValueError, also where there are too many products.
    """
    _check(sources)
    # The intersection and the union so far are all that a product is known by; many have the same ones.
    met: dict[tuple[int, int], float] = {(subset, subset): mass for subset, mass in sources[0].masses.items()}
    for source in sources[1:]:
        _check_products(len(met) * len(source.masses))
        joined: dict[tuple[int, int], float] = {}
        for (common, union), mass in met.items():
            for subset, other in source.masses.items():
                key = (common & subset, union | subset)
                joined[key] = joined.get(key, 0.0) + mass * other
        met = joined
    weights: dict[int, float] = {}
    for (common, union), mass in met.items():
        weights[common or union] = weights.get(common or union, 0.0) + mass
    conflict = math.fsum(mass for (common, _), mass in met.items() if not common)
    return Combination(normalised(sources[0].size, weights), _share(conflict))


def pcr6(sources: Sequence[BeliefAssignment]) -> Combination:
    """Proportional conflict redistribution. A vacuous source beside two or more others is not neutral: it takes its part.

    Raises ValueError, also where there are too many products.
    """
    _check(sources)
    _check_products(math.prod(len(source.masses) for source in sources))
    weights: dict[int, float] = {}
    conflicts: list[float] = []
    everything = everything_of(sources[0].size)
    for focals in product(*(source.masses.items() for source in sources)):
        common, amount, total = everything, 1.0, 0.0
        for subset, mass in focals:
            common, amount, total = common & subset, amount * mass, total + mass
        if common:
            weights[common] = weights.get(common, 0.0) + amount
        elif amount > 0:
            conflicts.append(amount)
            _give_back(weights, focals, amount / total)
    return Combination(normalised(sources[0].size, weights), _share(math.fsum(conflicts)))


RULES: Mapping[RuleName, Rule] = {"dempster": dempster, "yager": yager, "dubois_prade": dubois_prade, "pcr6": pcr6}


def _give_back(weights: dict[int, float], focals: Sequence[tuple[int, float]], part: float) -> None:
    """A conflicting product to its sets: `part` of the mass of each."""
    for subset, mass in focals:
        weights[subset] = weights.get(subset, 0.0) + part * mass


def _check(sources: Sequence[BeliefAssignment]) -> None:
    if not sources:
        raise ValueError("sources: there is none to combine")
    sizes = {source.size for source in sources}
    if len(sizes) > 1:
        raise ValueError(f"the frames differ: {', '.join(map(str, sorted(sizes)))} hypotheses")


def _check_products(count: int) -> None:
    if count > MOST_PRODUCTS:
        raise ValueError(f"sources: {count} products of focal sets are more than {MOST_PRODUCTS}")


def _share(value: float) -> float:
    return min(1.0, max(0.0, value))
