"""The JSON file of `deixis paper`. Its keys are documented here and stay:

* `rooms.A|B|C` in the mode asked for: `N`, `n_av`, and as shares of N `Corm`, `Cors`, `False`, `Vh`, `Ch`, `Vf`, `Cf`.
  `published` has the same shape; so has `modes.MODE` for each mode that was run on the same trials: `paper`, and with
  `--mode deixis` also `deixis` and `deixis_paper_readings`, which is without what our stages tell beyond the paper's; `ideal`
  and `ideal_paper_readings`, what the likeliest POI by Bayes' rule comes to on the readings of each.
* `intervals.A|B|C`: 95 % intervals (Wilson) of the shares in `rooms`.
* `table_1.GESTURE.REGION`: `share`, `interval_95`, `published`.
* With `--mismatch`: `mismatch.RULE` has `wrong_above_0.9` (share of the answers with a belief above .9; null where there is
  none), `interval_95` of that, `answered` and `answered_above_0.9` (shares of all trials), `wrong` (share of the answers), and
  the same by room in `rooms`; `mismatch_conflict` is the mean 1 - K of `matched` and `mismatched` heads.
* `assumptions` (sentences), `seconds` (of simulating), `trials`, `seed`, `mode`, `mismatch_share`, `settings`, `machine`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from deixis_fusion.confusion import table_1
from deixis_fusion.pointing import GESTURES, REGIONS

from .machine import Machine
from .paper_assumptions import assumptions
from .paper_figures import PUBLISHED, SHARES, Counts
from .paper_simulation import RoomResult, RuleCounts, Study
from .proportion import Proportion

Results = Mapping[str, RoomResult]


def report(study: Study, results: Results, seconds: float, settings: Sequence[str], machine: Machine) -> dict[str, Any]:
    """The content of the file."""
    modes = next(iter(results.values())).by_mode
    content: dict[str, Any] = {
        "trials": study.trials,
        "seed": study.seed,
        "mode": study.mode,
        "settings": list(settings),
        "rooms": {name: rows(result.by_mode[study.mode]) for name, result in results.items()},
        "published": {name: rows(PUBLISHED[name]) for name in results},
        "intervals": {name: intervals(result.by_mode[study.mode]) for name, result in results.items()},
        "modes": {mode: {name: rows(result.by_mode[mode]) for name, result in results.items()} for mode in modes},
        "table_1": gestures(results),
        "assumptions": assumptions(study),
        "seconds": round(seconds, 3),
        "machine": machine,
    }
    if study.mismatch > 0:
        content |= {"mismatch_share": study.mismatch, "mismatch": mismatch(results), "mismatch_conflict": conflicts(results)}
    return content


def rows(counts: Counts) -> dict[str, Any]:
    """Tables 2 and 3 of one room."""
    return {"N": counts.trials, "n_av": counts.n_av} | {row: counts.share(row).share for row in SHARES}


def intervals(counts: Counts) -> dict[str, Any]:
    """Of the shares."""
    return {row: _interval(counts.share(row)) for row in SHARES}


def gestures(results: Results) -> dict[str, Any]:
    """Table 1 as it came out in all rooms together."""
    table = recognised(results)
    return {
        gesture: {
            region: {
                "share": table[g][r].share,
                "interval_95": _interval(table[g][r]),
                "published": table_1().share(gesture, region),
            }
            for r, region in enumerate(REGIONS)
        }
        for g, gesture in enumerate(GESTURES)
    }


def recognised(results: Results) -> list[list[Proportion]]:
    """Of the trials in which a region was pointed to, those in which a gesture was recognised: by GESTURES, by REGIONS."""
    table = np.sum([result.gestures for result in results.values()], axis=0)
    columns = table.sum(axis=0)
    return [[Proportion(int(table[g, r]), int(columns[r])) for r in range(len(REGIONS))] for g in range(len(GESTURES))]


def of_rule(results: Results, rule: str) -> RuleCounts:
    """All rooms together."""
    return sum((result.by_rule[rule] for result in results.values()), RuleCounts())


def mismatch(results: Results) -> dict[str, Any]:
    """By rule, in all rooms and in each."""
    rules = next(iter(results.values())).by_rule
    return {
        rule: _rule(of_rule(results, rule)) | {"rooms": {name: _rule(result.by_rule[rule]) for name, result in results.items()}}
        for rule in rules
    }


def conflicts(results: Results) -> dict[str, float | None]:
    """Mean conflict mass 1 - K of hand and head by the paper's masses, with heads that look where the hand points or not."""
    mismatched = sum(result.mismatched for result in results.values())
    matched = sum(result.by_rule["dempster"].trials for result in results.values()) - mismatched
    sums = {
        "matched": (sum(result.conflict_matched for result in results.values()), matched),
        "mismatched": (sum(result.conflict_mismatched for result in results.values()), mismatched),
    }
    return {name: total / count if count else None for name, (total, count) in sums.items()}


def _rule(counts: RuleCounts) -> dict[str, Any]:
    return {
        "wrong_above_0.9": counts.wrong_of_sure.share,
        "interval_95": _interval(counts.wrong_of_sure),
        "answered": counts.answered / counts.trials,
        "answered_above_0.9": counts.sure / counts.trials,
        "wrong": Proportion(counts.wrong, counts.answered).share,
    }


def _interval(proportion: Proportion) -> list[float] | None:
    return None if proportion.interval is None else list(proportion.interval)
