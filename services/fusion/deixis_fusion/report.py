"""A judgement as the parts of the messages Belief and Target."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice

from deixis_schemas.messages import MAX_LISTED, Evidence, FocalSet, Poi, PoiBelief

from .belief import BeliefAssignment, members
from .discernment import Candidate
from .judgement import Judgement
from .witnesses import Witness, Witnesses


def poi_beliefs(judgement: Judgement, seen: Sequence[Candidate]) -> list[PoiBelief]:
    """The standing of each candidate, in their order."""
    belief = judgement.combination.belief
    rows = zip(seen, belief.singletons(), belief.plausibilities(), belief.pignistic(), strict=True)
    return [
        PoiBelief(
            poi_id=candidate.poi.poi_id, mass=mass, belief=mass, plausibility=plausibility, pignistic=pignistic,
            bearing_deg=candidate.bearing_deg,
        )
        for candidate, mass, plausibility, pignistic in rows
    ]  # fmt: skip


def unplaced(pois: Sequence[Poi]) -> list[PoiBelief]:
    """All POIs with nothing known of any: for a person whose place is unknown."""
    return [PoiBelief(poi_id=poi.poi_id, mass=0.0, belief=0.0, plausibility=1.0, pignistic=1 / len(pois)) for poi in pois]


def evidence(
    witnesses: Witnesses, judgement: Judgement | None, seen: Sequence[Candidate], now_ns: int | None
) -> list[Evidence]:
    """What each source contributed. `now_ns` is none where time stands still: ages are 0 then."""
    hand = judgement.hand if judgement else None
    head = judgement.head if judgement else None
    return [
        _evidence("gesture", witnesses.gesture, hand, seen, now_ns),
        _evidence("headpose", witnesses.headpose, head, seen, now_ns),
    ]


def _evidence(
    source: str, witness: Witness, assignment: BeliefAssignment | None, seen: Sequence[Candidate], now_ns: int | None
) -> Evidence:
    age_ms = None
    if witness.stamp_ns is not None:
        age_ms = 0.0 if now_ns is None else max(0.0, (now_ns - witness.stamp_ns) / 1e6)
    return Evidence(
        source=source,
        producer=witness.producer,
        status=witness.status,
        observed=witness.observed,
        age_ms=age_ms,
        weight=1.0 - assignment.unknown if assignment else 0.0,
        masses=_focal_sets(assignment, seen) if assignment else [],
    )


def _focal_sets(assignment: BeliefAssignment, seen: Sequence[Candidate]) -> list[FocalSet]:
    largest = sorted(assignment.masses.items(), key=lambda item: (-item[1], item[0]))[:MAX_LISTED]
    return [
        FocalSet(poi_ids=[seen[i].poi.poi_id for i in islice(members(subset), MAX_LISTED)], size=subset.bit_count(), mass=mass)
        for subset, mass in largest
        if mass > 0
    ]
