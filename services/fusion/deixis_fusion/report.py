"""What is thought of a person, told: as parts of the messages Belief, Target and State, and as a sentence that says why.

Messages are bounded by construction: the likeliest POIs, the largest sets, the first members of a set, titles cut short.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

from deixis_schemas import messages
from deixis_schemas.messages import MAX_LISTED, MAX_TEXT, OfFrame, PersonBelief, Poi, PoiBelief, Producer, Target

from .belief import BeliefAssignment, members
from .decision import Judgement
from .evidence import Evidence, HandObservation, HeadObservation, Witness
from .localisation import PersonPlace
from .visibility import Candidate

NOTABLE_CONFLICT = 0.7
MAX_TITLE = 60
MAX_TIED_NAMED = 8
# Members named in all sets of one source together: a Belief about many persons stays below the topic's limit.
MAX_MEMBERS = 96


@dataclass(frozen=True)
class Rows:
    """Which POIs a message tells of: the `top` likeliest, or the one called `poi_id`."""

    top: int
    poi_id: str | None = None


class Assessment(NamedTuple):
    """What is thought of one person at one frame. `judgement` is none where no POI comes into question.

    `pois` are all there are; `doubt` says why the robot may have stood elsewhere, if so.
    """

    place: PersonPlace | None
    evidence: Evidence
    judgement: Judgement | None
    pois: Sequence[Poi]
    doubt: str = ""

    @property
    def poi_ids(self) -> tuple[str, ...]:
        """The answer."""
        return self.judgement.poi_ids if self.judgement else ()

    @property
    def best(self) -> float:
        """Largest pignistic probability."""
        return max(self.judgement.pignistic) if self.judgement else 0.0

    @property
    def conflict(self) -> float:
        """Conflict mass 1 - K."""
        return self.judgement.combination.conflict if self.judgement else 0.0

    @property
    def contour_conflict(self) -> float:
        """How much hand and head contradict each other."""
        return self.judgement.contour_conflict if self.judgement else 0.0


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
        return PersonBelief(
            person_id=self.person_id,
            position_m=place.position_m if place else None,
            distance_m=place.distance_m if place else None,
            pois=_rows(judgement, rows) if judgement else _vacuous_rows(unplaced, rows),
            pois_total=len(judgement.seen) if judgement else len(unplaced),
            unknown=judgement.combination.belief.unknown if judgement else 1.0,
            conflict=told.conflict,
            contour_conflict=told.contour_conflict,
            evidence=_evidence(told, self.now_ns),
            episode_id=self.episode_id,
        )


@dataclass(frozen=True)
class TargetReport:
    """One answer of an episode, from which messages of any length are made. `frame` names the producer."""

    frame: OfFrame
    person_id: int
    episode_id: str
    started_ns: int
    ended_ns: int
    final: bool
    assessment: Assessment
    now_ns: int | None

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
            evidence=_evidence(told, self.now_ns),
            reason=explain(told),
            started_ns=self.started_ns,
            ended_ns=self.ended_ns,
            latency_ms=0.0 if self.now_ns is None else max(0.0, (self.now_ns - self.frame.stamp_ns) / 1e6),
        )


# --- rows -------------------------------------------------------------------------------------------------------------


def _rows(judgement: Judgement, rows: Rows) -> list[PoiBelief]:
    """The standing of the POIs asked for, best first."""
    seen, pignistic = judgement.seen, judgement.pignistic
    chosen = sorted(range(len(seen)), key=pignistic.__getitem__, reverse=True)
    if rows.poi_id is not None:
        chosen = [i for i in chosen if seen[i].poi.poi_id == rows.poi_id]
    plausible = judgement.combination.belief.plausibilities()
    single = judgement.combination.belief.singletons()
    return [
        PoiBelief(
            poi_id=seen[i].poi.poi_id, mass=single[i], belief=single[i], plausibility=plausible[i], pignistic=pignistic[i],
            bearing_deg=seen[i].bearing_deg,
        )
        for i in chosen[: rows.top]
    ]  # fmt: skip


def _vacuous_rows(pois: Sequence[Poi], rows: Rows) -> list[PoiBelief]:
    """POIs with nothing known of any: for a person whose place is unknown."""
    asked = [poi for poi in pois if rows.poi_id in (None, poi.poi_id)][: rows.top]
    return [PoiBelief(poi_id=poi.poi_id, mass=0.0, belief=0.0, plausibility=1.0, pignistic=1 / len(pois)) for poi in asked]


# --- evidence ---------------------------------------------------------------------------------------------------------


def _evidence(told: Assessment, now_ns: int | None) -> list[messages.Evidence]:
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
    source: str, witness: Witness, assignment: BeliefAssignment | None, judgement: Judgement | None, now_ns: int | None
) -> messages.Evidence:
    age_ms = None
    if witness.stamp_ns is not None:
        age_ms = 0.0 if now_ns is None else max(0.0, (now_ns - witness.stamp_ns) / 1e6)
    return messages.Evidence(
        source=source,
        producer=witness.producer,
        status=witness.status,
        observed=cut(witness.observed, MAX_TEXT),
        age_ms=age_ms,
        weight=1.0 - assignment.unknown if assignment else 0.0,
        masses=_focal_sets(assignment, judgement.seen) if assignment and judgement else [],
    )


def _focal_sets(assignment: BeliefAssignment, seen: Sequence[Candidate]) -> list[messages.FocalSet]:
    """The sets of largest mass, each with its first members."""
    largest = sorted(assignment.masses.items(), key=lambda item: (-item[1], item[0]))
    sets, left = [], MAX_MEMBERS
    for subset, mass in largest[:MAX_LISTED]:
        named = [seen[i].poi.poi_id for i in islice(members(subset), min(left, MAX_LISTED))]
        left -= len(named)
        if mass > 0:
            sets.append(messages.FocalSet(poi_ids=named, size=subset.bit_count(), mass=mass))
    return sets


# --- words ------------------------------------------------------------------------------------------------------------


def explain(told: Assessment) -> str:
    """Why: one plain sentence for people, which names the evidence."""
    evidence, judgement = told.evidence, told.judgement
    observed = f"The person {hand_words(evidence.hand)} and {head_words(evidence.head)}"
    robot = f"; robot/pose is in doubt: {told.doubt}" if told.doubt else ""
    if judgement is None:
        why = "no POI is in sight of the person" if told.place else "where the person stands is not known"
        return cut(f"{observed}; no answer: {why}{robot}.", MAX_TEXT)
    if not judgement.choice.hypotheses:
        return cut(f"{observed}; no answer: {judgement.choice.abstains}{robot}.", MAX_TEXT)
    return cut(f"{observed}; {_answer_words(judgement)}{_runner_up(judgement)}{_doubt(judgement)}{robot}.", MAX_TEXT)


def _answer_words(judgement: Judgement) -> str:
    chosen = judgement.choice.hypotheses
    names = [
        f"'{title(judgement.seen[i].poi)}' lies at {judgement.seen[i].bearing_deg:.0f} deg ({judgement.pignistic[i]:.2f})"
        for i in chosen[:MAX_TIED_NAMED]
    ]
    if len(chosen) == 1:
        return names[0]
    more = f" and {len(chosen) - len(names)} more" if len(chosen) > len(names) else ""
    return "tied are " + ", ".join(names) + more


def _runner_up(judgement: Judgement) -> str:
    rest = set(range(len(judgement.seen))) - set(judgement.choice.hypotheses)
    if not rest:
        return ""
    best = min(rest, key=lambda i: (-judgement.pignistic[i], i))
    return f"; the next best is '{title(judgement.seen[best].poi)}' ({judgement.pignistic[best]:.2f})"


def _doubt(judgement: Judgement) -> str:
    conflict = judgement.contour_conflict
    return f"; hand and head disagree (contour conflict {conflict:.2f})" if conflict > NOTABLE_CONFLICT else ""


def title(poi: Poi) -> str:
    """What people call the POI, cut short where it is long."""
    return cut(poi.name or poi.poi_id, MAX_TITLE)


def cut(text: str, longest: int) -> str:
    """The text, with an ellipsis where it is longer than that."""
    return text if len(text) <= longest else text[: longest - 1] + "\N{HORIZONTAL ELLIPSIS}"


def hand_words(hand: HandObservation | None) -> str:
    """What the hand does."""
    if hand is None:
        return "shows no pointing hand"
    which = f"the {hand.hand} hand" if hand.hand else "a hand"
    if hand.gesture == "invisible":
        words = f"holds up {which} without a distinguishable finger"
    else:
        words = f"points to the {hand.gesture.removeprefix('point_')} with {which}"
    if hand.bearing_deg is None or hand.bearing_sigma_deg is None:
        return words
    mirror = f" or {hand.mirror_deg:.0f}" if hand.mirror_deg is not None else ""
    return f"{words} (about {hand.bearing_deg:.0f}{mirror} +- {hand.bearing_sigma_deg:.0f} deg)"


def head_words(head: HeadObservation | None) -> str:
    """What the head does."""
    if head is None:
        return "the head is not tracked"
    if head.yaw_deg is None:
        return f"the head is turned far{f' {head.side}' if head.side else ''}, out of range"
    if abs(head.yaw_deg) < 10:
        return "the head faces the camera"
    return f"the head is turned {abs(head.yaw_deg):.0f} deg {'left' if head.yaw_deg > 0 else 'right'}"
