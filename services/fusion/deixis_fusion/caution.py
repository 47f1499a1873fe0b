"""A stage that dies in a stroke must not make the answer more certain.

Hand to one side and head to the other: two POIs are tied. Once the gesture stage is dead its word counts for nothing, and the
head alone would name one of the two. So while a stage that has spoken in a stroke is gone, no answer is surer than the last one
with it, and none names one POI of those that were tied.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .decision import Choice, Judgement
from .evidence import Evidence
from .mass_vector import Combined

Values = npt.NDArray[np.float64]

ROUNDING = 1e-12
GONE = ("dead", "late", "wrong_version")
WHY = "a stage that spoke for more than one POI is gone"


@dataclass(frozen=True)
class _Heard:
    """The last judgement with all the stages that had spoken, and their names."""

    stages: frozenset[str]
    judgement: Judgement

    @property
    def poi_ids(self) -> frozenset[str]:
        """What it answered."""
        return frozenset(self.judgement.poi_ids)


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
        self._heard = _Heard(speaking, judgement)
        return judgement


def _sources(evidence: Evidence) -> dict[str, bool]:
    return {"gesture": evidence.hand is not None, "headpose": evidence.head is not None}


def _is_gone(evidence: Evidence, name: str) -> bool:
    witness = evidence.gesture if name == "gesture" else evidence.headpose
    return not _sources(evidence)[name] and witness.status in GONE


def _no_surer(judgement: Judgement, heard: _Heard) -> Judgement:
    """Chances mixed with equal ones, and masses discounted, until the likeliest POIs, however many, have no more than they had.

    Both go linearly toward 1 / n. So neither is the credible set smaller. All that was answered before, still is.
    """
    even = 1 / len(judgement.seen)
    rate = _rate(judgement.chances, _together(heard.judgement.chances))
    chances = (1 - rate) * judgement.chances + rate * even
    belief = judgement.combination.belief.discounted(_rate(judgement.pignistic, _together(heard.judgement.pignistic)))
    weakened = replace(judgement, chances=chances, combination=Combined(belief, judgement.combination.conflict))
    return replace(weakened, choice=_no_narrower(weakened, heard))


def _together(shares: Values) -> Values:
    """What the likeliest has, the two likeliest, the three ... (n)."""
    return np.cumsum(np.sort(shares)[::-1])


def _rate(shares: Values, most: Values) -> float:
    """How much of the shares must be made equal for the likeliest to have no more together than `most` (`_together`)."""
    now, size = _together(shares), len(shares)
    # Other POIs may have come into sight since: beyond those that there were, all have had everything.
    allowed = np.concatenate([most[:size], np.full(max(0, size - len(most)), 1.0)])
    above = now - np.arange(1, size + 1) / size
    excess = np.divide(now - allowed, above, out=np.zeros(size), where=(now > allowed) & (above > ROUNDING))
    return float(np.clip(excess.max(), 0.0, 1.0))


def _no_narrower(judgement: Judgement, heard: _Heard) -> Choice:
    """The answer with all POIs in it that were tied before; none where there was none."""
    answered = frozenset(judgement.poi_ids)
    if not answered:
        return judgement.choice
    if not heard.poi_ids:
        return Choice((), WHY)
    if answered >= heard.poi_ids:
        return judgement.choice
    both = answered | heard.poi_ids
    return Choice(tuple(int(i) for i in np.argsort(-judgement.chances, kind="stable") if judgement.seen[i].poi.poi_id in both))
