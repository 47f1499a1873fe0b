"""The rows of tables 2 and 3, as counts of trials; and the published ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt
from deixis_fusion.config import FusionConfig
from deixis_fusion.perceived_yaw import PerceivedYaw
from deixis_fusion.pointing import GESTURES, REGIONS

from .paper_masses import Answers, Sources, largest_focals
from .paper_trials import Trials, regions
from .proportion import Proportion

Flags = npt.NDArray[np.bool_]
Sets = npt.NDArray[np.int64]

SHARES = ("Corm", "Cors", "False", "Vh", "Ch", "Vf", "Cf")
"""The rows that are shares of all trials, by their names in the paper."""
MEANINGS = {
    "n_av": "POIs in an answer, mean",
    "Corm": "the POI meant is among the answers",
    "Cors": "it is the only answer",
    "False": "it is not among the answers",
    "Vh": "the POI meant is where a pointing hand is recognised",
    "Ch": "the hand alone: recognised rightly, and one POI in that region",
    "Vf": "the POI meant is where a head is recognised",
    "Cf": "the head alone: computed, and the POI meant fits best",
}


@dataclass(frozen=True)
class Counts:
    """Of `trials`; `answers` is the number of POIs in all answers together. The others are trials, by `MEANINGS`."""

    trials: int = 0
    answers: int = 0
    corm: int = 0
    cors: int = 0
    false: int = 0
    vh: int = 0
    ch: int = 0
    vf: int = 0
    cf: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(*(getattr(self, item.name) + getattr(other, item.name) for item in fields(self)))

    @property
    def n_av(self) -> float:
        """Mean number of POIs in an answer."""
        return self.answers / self.trials if self.trials else 0.0

    def share(self, row: str) -> Proportion:
        """Of a row of `SHARES`."""
        return Proportion(getattr(self, row.lower()), self.trials)


PUBLISHED = {
    "A": Counts(1000, 1060, 996, 961, 4, 550, 245, 731, 722),
    "B": Counts(1000, 1250, 970, 819, 30, 558, 47, 730, 703),
    "C": Counts(1000, 1130, 997, 927, 3, 535, 336, 796, 776),
}
"""Tables 2 and 3; `answers` from n_av, which has two decimals."""


def count(trials: Trials, both: Sources, perceived: PerceivedYaw, answers: Answers, config: FusionConfig) -> Counts:
    """Count trials that were answered. `perceived` is figure 6 within the head's range."""
    meant = np.asarray(1 << trials.arrangements.meant, dtype=np.int64)
    size, right = sizes(answers.sets), (answers.sets & meant) > 0
    visible_by_hand, right_by_hand = _by_hand(trials, config)
    within = np.abs(trials.arrangements.meant_deg) <= config.paper.phi_f_max_deg
    computed = trials.yaw < len(perceived.yaw_deg)
    right_by_head = within & computed & (largest_focals(both.head) == meant)
    tallies = (right, right & (size == 1), ~right, visible_by_hand, right_by_hand, within, right_by_head)
    return Counts(len(trials), int(size.sum()), *(int(np.count_nonzero(tally)) for tally in tallies))


def total(parts: Iterable[Counts]) -> Counts:
    """All of them together."""
    return sum(parts, Counts())


def sizes(sets: Sets) -> npt.NDArray[np.int64]:
    """How many POIs each set has."""
    return np.bitwise_count(sets).astype(np.int64)


def _by_hand(trials: Trials, config: FusionConfig) -> tuple[Flags, Flags]:
    """Whether the POI meant is to one side where a hand is recognised; and whether it was, and no other POI is there."""
    meant = regions(trials.arrangements.meant_deg, config)
    of_poi = regions(trials.arrangements.bearing_deg, config)
    alone = ((of_poi == meant[:, None]) & trials.arrangements.visible).sum(axis=1) == 1
    visible = meant != REGIONS.index("center")
    right = {"left": GESTURES.index("point_left"), "right": GESTURES.index("point_right")}
    gesture = np.where(meant == REGIONS.index("left"), right["left"], right["right"])
    return visible, visible & alone & (trials.gesture == gesture)
