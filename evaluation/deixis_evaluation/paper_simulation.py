"""The experiment of section 7.2: arrangements in a room, readings of hand and head, and what the rules make of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np
import numpy.typing as npt
from deixis_fusion.config import FusionConfig
from deixis_fusion.perceived_yaw import PerceivedYaw
from deixis_fusion.pointing import GESTURES, REGIONS

from .paper_arrangements import Arrangements, draw
from .paper_deixis import OURS, PAPERS, DeixisModel
from .paper_figures import Counts, count, sizes
from .paper_ideal import ideal_answers
from .paper_masses import RULES, Answers, Sources, answers, conflict, dempster, sources
from .paper_rooms import ROOMS, Room
from .paper_trials import Trials, perceive, regions
from .proportion import Proportion

Mode = Literal["paper", "deixis_paper_readings", "deixis", "ideal_paper_readings", "ideal"]
OnTrials = Callable[[int], None]
PART = 10_000
"""Trials at a time: so a million do not fill the memory."""
SURE = 0.9


@dataclass(frozen=True)
class Study:
    """What is simulated: `trials` in each room. Mode `deixis` runs the paper's rules and an ideal observer on them, too."""

    trials: int
    seed: int
    mode: Mode = "paper"
    mismatch: float = 0.0
    config: FusionConfig = field(default_factory=FusionConfig)


@dataclass(frozen=True)
class RuleCounts:
    """Of trials some of whose heads look at the robot: how many were answered, with a belief above SURE, and wrongly."""

    trials: int = 0
    answered: int = 0
    wrong: int = 0
    sure: int = 0
    sure_wrong: int = 0

    def __add__(self, other: RuleCounts) -> RuleCounts:
        return RuleCounts(*(getattr(self, item.name) + getattr(other, item.name) for item in fields(self)))

    @property
    def wrong_of_sure(self) -> Proportion:
        """Of the answers above SURE, those without the POI meant."""
        return Proportion(self.sure_wrong, self.sure)


@dataclass(frozen=True)
class RoomResult:
    """One room: tables 2 and 3 by mode, what gestures were recognised of what (GESTURES, REGIONS), and with mismatch the counts
    of each rule. `conflict_mismatched` and `conflict_matched` are sums of 1 - K over `mismatched` trials and over the others.
    """

    by_mode: Mapping[Mode, Counts]
    gestures: npt.NDArray[np.int64]
    by_rule: Mapping[str, RuleCounts] = field(default_factory=dict)
    mismatched: int = 0
    conflict_mismatched: float = 0.0
    conflict_matched: float = 0.0

    def __add__(self, other: RoomResult) -> RoomResult:
        return RoomResult(
            {mode: counts + other.by_mode[mode] for mode, counts in self.by_mode.items()},
            self.gestures + other.gestures,
            {rule: counts + other.by_rule[rule] for rule, counts in self.by_rule.items()},
            self.mismatched + other.mismatched,
            self.conflict_mismatched + other.conflict_mismatched,
            self.conflict_matched + other.conflict_matched,
        )


class Simulation:
    """The same study gives the same trials, whatever the mode; with mismatch other heads in the same arrangements."""

    def __init__(self, study: Study) -> None:
        self._study, config = study, study.config
        self._perceived = PerceivedYaw.of(config.confusion.head).within(config.paper.phi_f_max_deg)
        self._ours: dict[Mode, DeixisModel] = {}
        if study.mode == "deixis" or study.mismatch > 0:
            self._ours["deixis_paper_readings"] = DeixisModel.of(config, self._perceived, PAPERS)
            self._ours["deixis"] = DeixisModel.of(config, self._perceived, OURS)

    def run_all(self, on_trials: OnTrials, is_stopped: Callable[[], bool] = lambda: False) -> tuple[dict[str, RoomResult], int]:
        """Simulate all rooms, a part of each in turn: when it is stopped, all have had the same number of trials.

        Returns the results by the rooms' names, and that number: less than asked for where it was stopped, and 0 at least.
        """
        results: dict[str, RoomResult] = {}
        done = 0
        for part, size in enumerate(_parts(self._study.trials)):
            found: dict[str, RoomResult] = {}
            for index, room in enumerate(ROOMS):
                if is_stopped():
                    return results, done
                found[room.name] = self._part(room, (index, part), size)
                on_trials(size)
            results = {name: results[name] + new if results else new for name, new in found.items()}
            done += size
        return results, done

    def run(self, room: Room, index: int, on_trials: OnTrials = lambda _count: None) -> RoomResult:
        """Simulate the room, the `index`-th; `on_trials` is told how many trials were done since it was last told."""
        result: RoomResult | None = None
        for part, size in enumerate(_parts(self._study.trials)):
            found = self._part(room, (index, part), size)
            result = found if result is None else result + found
            on_trials(size)
        if result is None:
            raise ValueError("trials: there is none to simulate")
        return result

    def trials(self, arrangements: Arrangements, place: tuple[int, int], mismatch: float = 0.0) -> Trials:
        """The readings in this part of a room."""
        return perceive(arrangements, self._perceived, self._study.config, mismatch, self._random(place, 1))

    def arrangements(self, room: Room, place: tuple[int, int], size: int) -> Arrangements:
        """The arrangements in this part of a room."""
        return draw(room, size, self._random(place, 0))

    def _random(self, place: tuple[int, int], what: int) -> np.random.Generator:
        return np.random.default_rng([self._study.seed, *place, what])

    def _part(self, room: Room, place: tuple[int, int], size: int) -> RoomResult:
        config, arrangements = self._study.config, self.arrangements(room, place, size)
        trials = self.trials(arrangements, place)
        both = sources(trials, self._perceived, config)
        by_mode: dict[Mode, Answers] = {"paper": answers(dempster(both))}
        if self._study.mode == "deixis":
            by_mode |= {mode: model.answers(trials) for mode, model in self._ours.items()}
            by_mode["ideal_paper_readings"] = ideal_answers(trials, self._perceived, config, PAPERS)
            by_mode["ideal"] = ideal_answers(trials, self._perceived, config, OURS)
        result = RoomResult(
            {mode: count(trials, both, self._perceived, answer, config) for mode, answer in by_mode.items()},
            _gestures(trials, config),
        )
        return result if self._study.mismatch <= 0 else self._mismatched(arrangements, place, result)

    def _mismatched(self, arrangements: Arrangements, place: tuple[int, int], result: RoomResult) -> RoomResult:
        config = self._study.config
        trials = self.trials(arrangements, place, self._study.mismatch)
        both = sources(trials, self._perceived, config)
        discounted = both.discounted(config.hand.discount, config.head.discount)
        by_rule: dict[str, Answers] = {name: answers(rule(both)) for name, rule in RULES.items()}
        by_rule["dempster_discounted"] = answers(dempster(discounted))
        by_rule |= {mode: model.answers(trials) for mode, model in self._ours.items()}
        opposed = conflict(both)
        return RoomResult(
            result.by_mode,
            result.gestures,
            {name: _rule_counts(trials, both, answer) for name, answer in by_rule.items()},
            int(trials.at_robot.sum()),
            float(opposed[trials.at_robot].sum()),
            float(opposed[~trials.at_robot].sum()),
        )


def _parts(trials: int) -> Iterator[int]:
    while trials > 0:
        yield min(PART, trials)
        trials -= PART


def _gestures(trials: Trials, config: FusionConfig) -> npt.NDArray[np.int64]:
    table = np.zeros((len(GESTURES), len(REGIONS)), dtype=np.int64)
    np.add.at(table, (trials.gesture, regions(trials.arrangements.meant_deg, config)), 1)
    return table


def _rule_counts(trials: Trials, both: Sources, answer: Answers) -> RuleCounts:
    """All visible POIs are no answer, where there are several."""
    meant = np.asarray(1 << trials.arrangements.meant, dtype=np.int64)
    answered = (answer.sets > 0) & ((answer.sets != both.everything) | (sizes(both.everything) == 1))
    wrong, sure = answered & (answer.sets & meant == 0), answered & (answer.belief > SURE)
    tallies: Sequence[npt.NDArray[np.bool_]] = (answered, wrong, sure, wrong & sure)
    return RuleCounts(len(trials), *(int(np.count_nonzero(tally)) for tally in tallies))
