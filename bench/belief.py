"""The belief engine beside pybelief: the same masses, the same rules, in one run.

usage: python bench/belief.py [--seconds S] [--json FILE]

* `N_pois`: hand and head by the paper's rules: three sets of POIs; single POIs with a set of those out of range; both with
  mass on the whole frame. `N_refined`: the hand by our rules, which has single POIs, too.
* `any_sets`: two sources of a dozen sets each.
* `ratio`: how often as long pybelief takes; `difference`: of the masses, at most. Both libraries take turns; each time is the
  least of all turns, in microseconds a combination. pybelief has no Dubois-Prade and no PCR6: there ours is told alone.
* `arrays` is Dempster's rule by fusion's own arrays (`mass_vector.py`), which combine hand and head but not any sets.

In the file: `RULE_us_CASE`, `RULE_pybelief_us_CASE`, `RULE_ratio_CASE`, `RULE_difference_CASE`, `arrays_us_CASE`,
`arrays_ratio_CASE`.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_fusion.belief import BeliefAssignment, as_set, everything_of, normalised
from deixis_fusion.combination import RULES, Rule
from deixis_fusion.mass_vector import MassVector
from deixis_fusion.mass_vector import combine as combine_arrays
from rich import box
from rich.console import Console
from rich.table import Table

try:
    from pybelief import MassFunction
except ImportError:
    MassFunction = None

POIS = (4, 8, 30, 100, 300)
ANY_SETS, ANY_SIZE = 12, 10
TURNS = 5
MOST_RUNS = 1 << 20
Figures = dict[str, float]
Way = Callable[[], Any]
Sources = tuple[BeliefAssignment, BeliefAssignment]


def hand_and_head(pois: int, rng: np.random.Generator, refined: bool = False) -> Sources:
    """Eq. 16 and eq. 18 with mass on the whole frame, as fusion discounts them; `refined`: with single POIs of the hand."""
    region, far = rng.integers(0, 3, pois), rng.random(pois) < 0.25
    region[:3], far[0] = (0, 1, 2), True
    sets = {as_set(np.flatnonzero(region == r).tolist()): float(rng.random() + 0.1) for r in range(3)}
    if refined:
        sets |= {1 << i: float(rng.random() + 0.01) for i in range(pois)}
    singles = {1 << int(i): float(rng.random() + 0.01) for i in np.flatnonzero(~far)}
    beyond = {as_set(np.flatnonzero(far).tolist()): 0.5}
    return normalised(pois, sets).discounted(0.08), normalised(pois, singles | beyond).discounted(0.05)


def any_sets(rng: np.random.Generator) -> Sources:
    """Two sources with any sets."""
    one, other = (
        normalised(ANY_SIZE, {int(s): float(rng.random() + 0.01) for s in rng.integers(1, everything_of(ANY_SIZE), ANY_SETS)})
        for _ in range(2)
    )
    return one, other


def ours(sources: Sources) -> dict[str, Way]:
    """Our rules by name."""

    def way(rule: Rule) -> Way:
        return lambda: rule(sources)

    return {name: way(rule) for name, rule in RULES.items()}


def theirs(sources: Sources) -> dict[str, Way]:
    """pybelief's, as far as it has them; none where it is not installed."""
    if MassFunction is None:
        return {}
    frame = [str(i) for i in range(sources[0].size)]
    one, other = (MassFunction(frame, dict(source.masses)) for source in sources)
    return {"dempster": lambda: one.combine_dempster(other), "yager": lambda: one.combine_yager(other)}


def measure(sources: Sources, case: str, seconds: float) -> Figures:
    """Figures of one case; both libraries take turns, each way for `seconds` in all."""
    own, others = ours(sources), theirs(sources)
    ways = own | {f"{name}_pybelief": way for name, way in others.items()}
    if case != "any_sets":
        one, other = (MassVector.of(source) for source in sources)
        ways["arrays"] = lambda: combine_arrays(one, other)
    times = least_times(ways, seconds)
    figures = {f"{name}_us_{case}": time_us for name, time_us in times.items()}
    for name, way in others.items():
        figures[f"{name}_ratio_{case}"] = times[f"{name}_pybelief"] / times[name]
        figures[f"{name}_difference_{case}"] = difference(own[name]().belief.masses, way().focal_elements())
    if "arrays" in times and others:
        figures[f"arrays_ratio_{case}"] = times["dempster_pybelief"] / times["arrays"]
    return figures


def least_times(ways: Mapping[str, Way], seconds: float) -> dict[str, float]:
    """Microseconds of each, the least of all turns."""
    counts = {name: _count(way, seconds / TURNS) for name, way in ways.items()}
    least = dict.fromkeys(ways, float("inf"))
    for _ in range(TURNS):
        for name, way in ways.items():
            least[name] = min(least[name], _time(way, counts[name]) / counts[name] * 1e6)
    return least


def difference(one: Mapping[int, float], other: Mapping[int, float]) -> float:
    """Of the masses, at most."""
    return max(abs(one.get(subset, 0.0) - other.get(subset, 0.0)) for subset in set(one) | set(other))


def table_of(figures: Figures, cases: Sequence[str]) -> Table:
    """A row for each case and rule."""
    table = Table(box=box.SIMPLE_HEAD, title="Two sources combined, microseconds", title_justify="left")
    for column in ("case", "rule", "ours", "pybelief", "ratio", "difference"):
        table.add_column(column, justify="left" if column in ("case", "rule") else "right")
    for case in cases:
        for rule in (*RULES, "arrays"):
            if f"{rule}_us_{case}" in figures:
                theirs_us = figures.get(f"{rule}_pybelief_us_{case}")
                cells = (figures[f"{rule}_us_{case}"], theirs_us, figures.get(f"{rule}_ratio_{case}"))
                told = ["-" if cell is None else f"{cell:.1f}" for cell in cells]
                off = figures.get(f"{rule}_difference_{case}")
                name = "dempster, arrays" if rule == "arrays" else rule
                table.add_row(case.replace("_", " "), name, *told, "-" if off is None else f"{off:.0e}")
    return table


def main() -> int:
    """Measure and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=0.25, help="for each rule and case (default: 0.25)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args()
    if not 0.001 <= given.seconds <= 60:
        parser.error("--seconds: not within 0.001 and 60")
    if MassFunction is None:
        print("pybelief is not installed (pip install -r bench/requirements_belief.txt): ours alone", file=sys.stderr)
    rng = np.random.default_rng(1)
    cases = {f"{pois}_pois": hand_and_head(pois, rng) for pois in POIS}
    cases |= {f"{pois}_refined": hand_and_head(pois, rng, refined=True) for pois in POIS} | {"any_sets": any_sets(rng)}
    figures: Figures = {}
    for case, sources in cases.items():
        figures |= measure(sources, case, given.seconds)
    machine, console = describe_machine(), Console()
    console.print(table_of(figures, list(cases)))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    return 0


def _count(way: Way, seconds: float) -> int:
    """How often it runs in so many seconds, about."""
    count, took = 1, _time(way, 1)
    while took < seconds / 10 and count < MOST_RUNS:
        count, took = 2 * count, _time(way, 2 * count)
    return max(1, int(count * seconds / max(took, 1e-9)))


def _time(way: Way, count: int) -> float:
    started = time.perf_counter()
    for _ in range(count):
        way()
    return time.perf_counter() - started


if __name__ == "__main__":
    raise SystemExit(main())
