"""Which POIs are told apart: the answers as a confusion matrix (place x POI x answered set), and shares by POI."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from deixis_evaluation.wilson import wilson

from .aims import Aim
from .answers import Answer, Cause
from .ground import GroundPoi

Verdict = Literal["told_apart", "tied", "confused", "untried"]
"""Of a POI: named in TOLD_APART_SHARE of its tries; named or among the answered ones in so many; in fewer; never tried."""

TOLD_APART_SHARE = 2 / 3


@dataclass(frozen=True)
class PoiResult:
    """What became of the tries of one POI, at all places or at one.

    outcomes: `named`, `in_set`, `missed`, `wrong`. confused_with: how often each other POI stood in the answer. causes: why it
    was not named.
    """

    poi: GroundPoi
    outcomes: Counter[str]
    confused_with: Counter[str]
    causes: Counter[Cause]

    @property
    def tries(self) -> int:
        """Pointings that were played."""
        return self.outcomes.total()

    @property
    def named_share(self) -> float | None:
        """Part of the tries in which it alone was answered; none without tries."""
        return self.outcomes["named"] / self.tries if self.tries else None

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of that share; 0 to 1 without tries."""
        return wilson(self.outcomes["named"], self.tries) or (0.0, 1.0)

    @property
    def verdict(self) -> Verdict:
        """How it stands."""
        if not self.tries:
            return "untried"
        if self.outcomes["named"] >= TOLD_APART_SHARE * self.tries - 1e-9:
            return "told_apart"
        within = self.outcomes["named"] + self.outcomes["in_set"]
        return "tied" if within >= TOLD_APART_SHARE * self.tries - 1e-9 else "confused"


@dataclass(frozen=True)
class Confusion:
    """All answers of a rehearsal, counted.

    matrix: by place and POI asked, how often each set of POIs was answered (the empty set: no answer). results: by POI, in the
    site's order; at_places: the same by place and POI. quiet: trials in which nobody pointed, quiet_answered: those of them
    with an answer. extra_answers: those that came in other trials besides the one to the pointing. failures: trials that could
    not be played, with the reason.
    """

    matrix: dict[tuple[str, str], Counter[frozenset[str]]]
    results: tuple[PoiResult, ...]
    at_places: dict[tuple[str, str], PoiResult] = field(default_factory=dict)
    quiet: int = 0
    quiet_answered: int = 0
    extra_answers: int = 0
    failures: tuple[tuple[str, str], ...] = ()

    @property
    def tries(self) -> int:
        """Pointings that were played."""
        return sum(result.tries for result in self.results)

    @property
    def named(self) -> int:
        """Pointings whose POI was named."""
        return sum(result.outcomes["named"] for result in self.results)

    @property
    def all_told_apart(self) -> bool:
        """Whether each POI is told apart."""
        return all(result.verdict == "told_apart" for result in self.results)

    def confused_pairs(self) -> list[tuple[str, str, int]]:
        """Pairs of POIs of which one stood in the answer to the other, and how often, the most frequent first."""
        pairs: Counter[tuple[str, str]] = Counter()
        for result in self.results:
            for other, times in result.confused_with.items():
                first, second = sorted((result.poi.poi_id, other))
                pairs[first, second] += times
        return [(first, second, times) for (first, second), times in pairs.most_common()]


def confusion_of(aims: Sequence[Aim], answers: Sequence[Answer], too_far: Sequence[GroundPoi] = ()) -> Confusion:
    """Count the answers. `aims` are all POIs from all places; the POIs `too_far` count as untried."""
    played = [answer for answer in answers if answer.failure is None]
    pointed = [answer for answer in played if answer.asked is not None]
    quiet = [answer for answer in played if answer.asked is None]
    matrix: dict[tuple[str, str], Counter[frozenset[str]]] = {}
    for answer in pointed:
        matrix.setdefault((answer.place, answer.asked or ""), Counter())[frozenset(answer.poi_ids)] += 1
    pois = list(dict.fromkeys([aim.poi for aim in aims] + list(too_far)))
    shown = [(aim.place.letter, aim.poi) for aim in aims if aim.hidden is None]
    return Confusion(
        matrix=matrix,
        results=tuple(_result(poi, [a for a in pointed if a.asked == poi.poi_id]) for poi in pois),
        at_places={
            (place, poi.poi_id): _result(poi, [a for a in pointed if (a.place, a.asked) == (place, poi.poi_id)])
            for place, poi in shown
        },
        quiet=len(quiet),
        quiet_answered=sum(bool(answer.false_answers) for answer in quiet),
        extra_answers=sum(len(answer.false_answers) for answer in pointed),
        failures=tuple((answer.trial, answer.failure) for answer in answers if answer.failure is not None),
    )


def _result(poi: GroundPoi, answers: Sequence[Answer]) -> PoiResult:
    others = (other for answer in answers for other in answer.poi_ids if other != poi.poi_id)
    return PoiResult(
        poi=poi,
        outcomes=Counter(answer.outcome for answer in answers if answer.outcome is not None),
        confused_with=Counter(others),
        causes=Counter(answer.cause for answer in answers if answer.cause is not None),
    )
