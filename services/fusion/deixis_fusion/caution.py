"""A stage that dies in a stroke must not make the answer more certain.

Hand to one side and head to the other: two POIs are tied. Once the gesture stage is dead its word counts for nothing, and the
head alone would name one of the two. So while a stage that has spoken in a stroke is gone, no answer is surer than the last one
with it, and none names one POI of those that were tied.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .belief import Combination
from .decision import Choice, Judgement
from .evidence import Evidence

GONE = ("dead", "late", "wrong_version")
WHY = "a stage that spoke for more than one POI is gone"


@dataclass(frozen=True)
class _Heard:
    """The last judgement with all the stages that had spoken: their names, how sure it was, and what it answered."""

    stages: frozenset[str]
    best: float
    poi_ids: frozenset[str]


class Caution:
    """Of one person. Call `judged` with each judgement of a stroke in order, `forget` between strokes."""

    def __init__(self) -> None:
        self._heard: _Heard | None = None

    def forget(self) -> None:
        """The stroke is over."""
        self._heard = None

    def judged(self, judgement: Judgement, evidence: Evidence) -> Judgement:
        """The judgement, no surer than before where a stage that has spoken in this stroke is gone."""
        speaking = frozenset(name for name, said in _sources(evidence).items() if said)
        heard = self._heard
        if heard is not None and any(name in heard.stages and _is_gone(evidence, name) for name in ("gesture", "headpose")):
            return _no_surer(judgement, heard)
        self._heard = _Heard(speaking, max(judgement.pignistic), frozenset(judgement.poi_ids))
        return judgement


def _sources(evidence: Evidence) -> dict[str, bool]:
    return {"gesture": evidence.hand is not None, "headpose": evidence.head is not None}


def _is_gone(evidence: Evidence, name: str) -> bool:
    witness = evidence.gesture if name == "gesture" else evidence.headpose
    return not _sources(evidence)[name] and witness.status in GONE


def _no_surer(judgement: Judgement, heard: _Heard) -> Judgement:
    """Discounted until no POI is likelier than the likeliest was (pignistic probabilities go linearly toward 1 / n)."""
    best, even = max(judgement.pignistic), 1 / len(judgement.seen)
    if best > heard.best and best > even:
        rate = min(1.0, (best - heard.best) / (best - even))
        belief = judgement.combination.belief.discounted(rate)
        judgement = replace(judgement, combination=Combination(belief, judgement.combination.conflict))
    answered = frozenset(judgement.poi_ids)
    if answered < heard.poi_ids or (answered and not heard.poi_ids):
        again = [i for i in _by_certainty(judgement) if judgement.seen[i].poi.poi_id in heard.poi_ids]
        judgement = replace(judgement, choice=Choice(tuple(again), "" if again else WHY))
    return judgement


def _by_certainty(judgement: Judgement) -> list[int]:
    return sorted(range(len(judgement.seen)), key=lambda i: (-judgement.pignistic[i], i))
