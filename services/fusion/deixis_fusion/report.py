"""What is thought of a person, told as parts of the messages Belief, Target and State.

Messages are bounded by construction: the likeliest POIs, the largest sets, the first members of a set, titles cut short.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

from deixis_schemas.messages import MAX_LISTED, MAX_TEXT, OfFrame, PersonBelief, Poi, Producer, Target

from .assessment import Assessment
from .decision import Judgement
from .evidence import Witness
from .mass_vector import MassVector
from .reasons import cut, explain
from .sight import bearings_at, ids_at
from .visibility import Candidate

# Members named in all sets of one source together: a Belief about many persons stays below the topic's limit.
MAX_MEMBERS = 96
LONGEST_LATENCY_NS = 10 * 10**9
# Parts of a message, which is made and validated at once, with all that is in it: one by one takes three times as long.
Content = dict[str, object]


@dataclass(frozen=True)
class Rows:
    """Which POIs a message tells of: the `top` likeliest, or the one called `poi_id`.

    So many `excluded` ones are named, and with any the reason in words; a Belief, which goes out with each frame, has neither.
    """

    top: int
    poi_id: str | None = None
    excluded: int = 0


class PersonReport(NamedTuple):
    """The standing of one person, from which messages of any length are made. `now_ns` is none where time stands still."""

    person_id: int
    assessment: Assessment
    episode_id: str | None
    now_ns: int | None

    def message(self, rows: Rows) -> PersonBelief:
        """The person as part of a Belief or State."""
        told = self.assessment
        place, judgement = told.place, told.judgement
        unplaced = told.pois if place is None else ()
        content: Content = {
            "person_id": self.person_id,
            "position_m": place.position_m if place else None,
            "distance_m": place.distance_m if place else None,
            "pois": _rows(judgement, rows) if judgement else _vacuous_rows(unplaced, rows),
            "pois_total": len(judgement.seen) if judgement else len(unplaced),
            "unknown": judgement.combination.belief.unknown if judgement else 1.0,
            "conflict": told.conflict,
            "contour_conflict": told.contour_conflict,
            "credible": _credible(told.judgement),
            "credible_total": len(told.judgement.credible) if told.judgement else 0,
            "excluded": _excluded(told, rows.poi_id, rows.excluded),
            "excluded_total": told.excluded_total if rows.excluded else 0,
            "evidence": _evidence(told, self.now_ns),
            "reason": explain(told) if rows.excluded else "",
            "episode_id": self.episode_id,
        }
        return PersonBelief.model_validate(content)


@dataclass(frozen=True)
class TargetReport:
    """One answer of an episode, from which messages of any length are made. `frame` names the producer.

    `now_ns` is by the clock of the camera's host, give or take `uncertain_ns`; none where the clocks were not compared.
    """

    frame: OfFrame
    person_id: int
    episode_id: str
    started_ns: int
    ended_ns: int
    final: bool
    assessment: Assessment
    now_ns: int | None
    uncertain_ns: int | None = None

    def message(self, rows: Rows) -> Target:
        """The answer as a message."""
        told = self.assessment
        return Target.derive(
            self.frame,
            Producer(self.frame.stage, self.frame.instance),
            episode_id=self.episode_id,
            person_id=self.person_id,
            final=self.final,
            poi_ids=list(told.poi_ids),
            pois=_rows(told.judgement, rows) if told.judgement else [],
            pois_total=len(told.judgement.seen) if told.judgement else 0,
            conflict=told.conflict,
            contour_conflict=told.contour_conflict,
            credible=_credible(told.judgement),
            credible_total=len(told.judgement.credible) if told.judgement else 0,
            excluded=_excluded(told, rows.poi_id, MAX_LISTED),
            excluded_total=told.excluded_total,
            evidence=_evidence(told, self.now_ns),
            reason=explain(told),
            started_ns=self.started_ns,
            ended_ns=self.ended_ns,
            latency_ms=0.0 if self.now_ns is None else max(0.0, (self.now_ns - self.frame.stamp_ns) / 1e6),
            latency_uncertain_ms=self._latency_uncertain_ms(),
        )

    def _latency_uncertain_ms(self) -> float | None:
        if self.now_ns is None:
            return 0.0
        if self.uncertain_ns is None:
            return None
        # A clock that was set since it was last compared shows by latencies that cannot be.
        possible = -self.uncertain_ns <= self.now_ns - self.frame.stamp_ns <= LONGEST_LATENCY_NS
        return self.uncertain_ns / 1e6 if possible else None


# --- rows -------------------------------------------------------------------------------------------------------------


def _rows(judgement: Judgement, rows: Rows) -> list[Content]:
    """The standing of the POIs asked for, best first: `PoiBelief`."""
    seen, chosen = judgement.seen, judgement.order
    if rows.poi_id is not None:
        chosen = chosen[[poi_id == rows.poi_id for poi_id in ids_at(seen, chosen)]]
    chosen = chosen[: rows.top]
    standing = (judgement.combination.belief.single, judgement.plausibilities, judgement.pignistic, judgement.chances)
    columns = [values[chosen].tolist() for values in standing]
    told = zip(ids_at(seen, chosen), *columns, bearings_at(seen, chosen), strict=True)
    return [
        {
            "poi_id": poi_id,
            "mass": alone,
            "belief": alone,
            "plausibility": plausibility,
            "pignistic": pignistic,
            "probability": chance,
            "bearing_deg": bearing,
        }
        for poi_id, alone, plausibility, pignistic, chance, bearing in told
    ]


def _vacuous_rows(pois: Sequence[Poi], rows: Rows) -> list[Content]:
    """POIs with nothing known of any: for a person whose place is unknown."""
    asked = [poi for poi in pois if rows.poi_id in (None, poi.poi_id)][: rows.top]
    even = 1 / max(1, len(pois))
    shares = {"mass": 0.0, "belief": 0.0, "plausibility": 1.0, "pignistic": even, "probability": even}
    return [{"poi_id": poi.poi_id, **shares} for poi in asked]


def _credible(judgement: Judgement | None) -> list[str]:
    """The first of the credible set."""
    return ids_at(judgement.seen, judgement.credible[:MAX_LISTED]) if judgement else []


def _excluded(told: Assessment, poi_id: str | None, most: int) -> list[Content]:
    """The nearest of the POIs that do not come into question, or the one asked for if it is among them."""
    asked = (one for one in told.excluded if one.poi.poi_id == poi_id)
    named = told.nearest_excluded(most) if poi_id is None else islice(asked, most)
    return [{"poi_id": poi.poi_id, "reason": reason} for poi, reason in named]


# --- evidence ---------------------------------------------------------------------------------------------------------


def _evidence(told: Assessment, now_ns: int | None) -> list[Content]:
    """What each source contributed; the robot's pose, which places everything, is named only where it is in doubt."""
    judgement, evidence = told.judgement, told.evidence
    listed = [
        _source("gesture", evidence.gesture, judgement.hand if judgement else None, judgement, now_ns),
        _source("headpose", evidence.headpose, judgement.head if judgement else None, judgement, now_ns),
    ]
    if told.doubt:
        listed.append(_source("robot", Witness("late", f"robot/pose: {told.doubt}"), None, None, now_ns))
    return listed


def _source(
    source: str, witness: Witness, assignment: MassVector | None, judgement: Judgement | None, now_ns: int | None
) -> Content:
    age_ms = None
    if witness.stamp_ns is not None:
        age_ms = 0.0 if now_ns is None else max(0.0, (now_ns - witness.stamp_ns) / 1e6)
    return {
        "source": source,
        "producer": witness.producer,
        "status": witness.status,
        "observed": cut(witness.observed, MAX_TEXT),
        "age_ms": age_ms,
        "weight": 1.0 - assignment.unknown if assignment else 0.0,
        "masses": _focal_sets(assignment, judgement.seen) if assignment and judgement else [],
    }


def _focal_sets(assignment: MassVector, seen: Sequence[Candidate]) -> list[Content]:
    """The sets of largest mass, each with its first members."""
    largest, named, counts = assignment.largest(MAX_LISTED), list[int](), list[int]()
    for focal in largest:
        counts.append(min(MAX_MEMBERS - len(named), MAX_LISTED, len(focal.members)))
        named.extend(focal.members[: counts[-1]])
    ids = iter(ids_at(seen, named))
    return [
        {"poi_ids": list(islice(ids, count)), "size": len(focal.members), "mass": focal.mass}
        for focal, count in zip(largest, counts, strict=True)
    ]
