"""Our rules, beyond the paper's: the answer by a product of likelihoods, and masses that explain it.

Every POI is weighed by the likelihood of what was seen given its bearing (`curves.py`, `weighing.py`). The answer follows from
the product of both sources alone: the odds of two POIs then depend on these two, not on how many others there are. The masses
of each source, and both by Dempster's rule, go with it; they decide nothing here. Bearings are degrees at the person, positive
toward the person's own left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .config import AnswerConfig, HandConfig, HeadConfig
from .confusion import HandConfusion, table_1
from .decision import Choice, Judgement
from .evidence import Evidence, HandObservation, HeadObservation
from .mass_vector import Flags, MassVector, combine
from .pointing import Region
from .sight import Sight
from .visibility import Candidate
from .weighing import SourceCurves, Weighing, weigh

Values = npt.NDArray[np.float64]
POSSIBILITY_LEVELS = 5
# A source whose likelihoods differ by less than this part of the largest tells nothing.
TOLD = 0.1
# Likelihoods that sum to less are none.
LEAST = 1e-300
REGION_ORDER: tuple[Region, ...] = ("left", "center", "right")
NOTHING_TOLD = "nothing was observed that tells the POIs apart"


@dataclass(frozen=True)
class DeixisRules:
    """Likelihoods of hand and head; the answer is what is likeliest, with ties and abstentions."""

    hand_config: HandConfig
    head_config: HeadConfig
    answer: AnswerConfig
    confusion: HandConfusion = field(default_factory=table_1)

    def judge(self, seen: Sequence[Candidate], evidence: Evidence) -> Judgement:
        """Weigh, and answer. `seen` is not empty."""
        sight = Sight.of(seen)
        weighed = weigh(evidence, sight, self.curves)
        hand, head = self._hand_masses(evidence, weighed, sight), self._head_masses(evidence, weighed)
        chances = weighed.chances(self.answer.tempering)
        choice = self.choose(weighed, chances, evidence)
        combined, conflict = combine(hand, head), weighed.contour_conflict
        return Judgement(sight, hand, head, combined, chances, choice, conflict, self.answer.credible)

    def _hand_masses(self, evidence: Evidence, weighed: Weighing, sight: Sight) -> MassVector:
        if evidence.hand is None:
            return MassVector.vacuous(len(sight))
        return hand_masses(evidence.hand, weighed.hand, sight, self.hand_config, self.confusion)

    def _head_masses(self, evidence: Evidence, weighed: Weighing) -> MassVector:
        if evidence.head is None:
            return MassVector.vacuous(len(weighed.head))
        return head_masses(evidence.head, weighed.head, weighed.head_floor, self.head_config)

    @cached_property
    def curves(self) -> SourceCurves:
        """What hand and head tell, kept from frame to frame."""
        return SourceCurves(self.hand_config, self.head_config, self.confusion)

    def choose(self, weighed: Weighing, chances: Values, evidence: Evidence) -> Choice:
        """The likeliest POIs, unless nothing was told, hand and head contradict each other, or no POI fits, or too many do."""
        answer, conflict = self.answer, weighed.contour_conflict
        tied = likeliest(chances, answer.tie_ratio)
        if conflict > answer.max_conflict:
            return Choice((), f"hand and head contradict each other (contour conflict {conflict:.3f})")
        if weighed.fit[tied[0]] < answer.least_fit:
            which = "the only POI in sight does not lie" if len(chances) == 1 else "no POI in sight lies"
            return Choice((), f"{which} where hand and head point")
        if not (_tells(weighed.hand, evidence.hand) or _tells(weighed.head, evidence.head)):
            return Choice((), NOTHING_TOLD)
        if len(tied) > answer.max_ties:
            return Choice((), f"{len(tied)} POIs are too near each other to be told apart")
        return Choice(tied)


def likeliest(chances: Values, tie_ratio: float) -> tuple[int, ...]:
    """The hypotheses that are at least `tie_ratio` times as likely as the likeliest, best first."""
    (tied,) = (chances >= tie_ratio * np.maximum.reduce(chances)).nonzero()
    return tuple(tied[(-chances[tied]).argsort(kind="stable")].tolist())


def _tells(likelihoods: Values, observed: HandObservation | HeadObservation | None) -> bool:
    """Whether a source tells POIs apart; whether a lone one is what was meant, tells how well it fits."""
    if observed is None:
        return False
    if len(likelihoods) == 1:
        return True
    return bool(np.minimum.reduce(likelihoods) < (1 - TOLD) * np.maximum.reduce(likelihoods))


# --- masses, to explain by ---------------------------------------------------------------------------------------------


def hand_masses(
    hand: HandObservation, likelihoods: Values, seen: Sight, config: HandConfig, confusion: HandConfusion
) -> MassVector:
    """Eq. 16 refined by the bearing of the hand: its sets keep part of their mass, the rest goes to single POIs.

    Without a bearing and with hard borders the single masses of a region sum to its mass by eq. 16, so the refinement adds
    what the bearing tells and nothing else.
    """
    sets, weights = _regions(hand, seen.bearings.likeliest, config, confusion)
    kept = 1 - config.discount
    of_single, of_regions = kept * config.refinement, kept * (1 - config.refinement)
    total = sum(weights)
    masses = np.array([*(of_regions * weight / total for weight in weights), config.discount])
    single = of_single / max(LEAST, float(np.add.reduce(likelihoods))) * likelihoods
    return MassVector.weighed(single, sets, masses)


def _regions(
    hand: HandObservation, bearings: Values, config: HandConfig, confusion: HandConfusion
) -> tuple[Flags, list[float]]:
    """Eq. 16: the POIs on the left, in the centre and on the right, and all (4, n); and the weights of these regions.

    P(G) is the share of the POIs in G. Where none of the regions with POIs can have shown this gesture, it is all POIs' alone.
    """
    size = np.abs(bearings)
    sets = np.ones((len(REGION_ORDER) + 1, len(bearings)), dtype=np.bool_)
    beside, left = (size >= config.min_deg) & (size <= config.max_deg), bearings > 0
    sets[0], sets[1], sets[2] = beside & left, ~beside, beside & ~left
    counts = np.add.reduce(sets[:-1], axis=1).tolist()
    shares = [confusion.share(hand.gesture, region) for region in REGION_ORDER]
    weights = [share * count / len(bearings) for share, count in zip(shares, counts, strict=True)]
    return (sets, weights) if any(weights) else (np.ones((2, len(bearings)), dtype=np.bool_), [1.0])


def head_masses(head: HeadObservation, likelihoods: Values, floor: float, config: HeadConfig) -> MassVector:
    """Eq. 18 with a head that turns only part of the way; beyond its range, mass on the POIs out there.

    Yaws that fit no POI, and yaws that fit a look at the robot, leave their mass on the whole frame: the head then says
    nothing, instead of choosing the least bad POI with full confidence. `floor` is their likelihood.
    """
    told = np.maximum(0.0, likelihoods - floor)
    if head.yaw_deg is None:
        return _out_of_range(told, floor).discounted(config.discount)
    single = told / len(told)
    kept = (1 - config.discount) / max(LEAST, float(np.add.reduce(single)) + floor)
    everything = np.ones((1, len(told)), dtype=np.bool_)
    return MassVector.weighed(kept * single, everything, np.array([kept * floor + config.discount]))


def _out_of_range(possible: Values, floor: float) -> MassVector:
    """Section 6.2: the head is turned beyond its range. Nested sets, the POIs that are surely out there innermost.

    The less likely it is that any POI lies out there, the less is said: where none does, something else was looked at. Cut off
    at a limit instead, a POI one degree farther made the difference between knowing nothing and all.
    """
    most = float(possible.max())
    if most <= 0:
        return MassVector.vacuous(len(possible))
    return consonant(possible / most).discounted(floor / (floor + most))


def consonant(possibilities: Values) -> MassVector:
    """The nested assignment whose plausibilities are these possibilities (the largest is 1), in five levels."""
    thresholds = (np.arange(POSSIBILITY_LEVELS, 0, -1) - 0.5) / POSSIBILITY_LEVELS
    return MassVector.normalised(np.zeros(len(possibilities)), [(possibilities >= limit, 1.0) for limit in thresholds])
