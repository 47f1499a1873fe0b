"""Tables 1 to 3 on the screen, ours beside the published ones, and what each rule does with heads that look elsewhere."""

from __future__ import annotations

from deixis_fusion.confusion import table_1
from deixis_fusion.pointing import GESTURES, REGIONS
from rich import box
from rich.console import Console
from rich.table import Table

from .paper_assumptions import assumptions
from .paper_figures import MEANINGS, PUBLISHED, SHARES, Counts
from .paper_report import Results, conflicts, of_rule, recognised
from .paper_simulation import RuleCounts, Study
from .proportion import Proportion

TABLE_2, TABLE_3 = SHARES[:3], SHARES[3:]
INTERVALS = "In brackets 95 % intervals (Wilson). * Ours and the published share lie outside of each other's interval."


def print_paper(console: Console, study: Study, results: Results) -> None:
    """All of it."""
    console.print(gesture_table(results))
    console.print(answer_table(study, results))
    console.print(source_table(results))
    _say(console, "; ".join(f"{row}: {meaning}" for row, meaning in MEANINGS.items()) + ".")
    _say(console, INTERVALS)
    if study.mismatch > 0:
        console.print(mismatch_table(study, results))
        _say(console, _conflict_line(results))
    console.print("Assumed, for the paper does not say:", style="bold", markup=False)
    for sentence in assumptions(study):
        _say(console, f"- {sentence}")


def gesture_table(results: Results) -> Table:
    """Table 1: what was recognised of what was meant, in all rooms together."""
    table = _table("Table 1: hand pointing gestures recognised (rows) of those made (columns), all rooms")
    for region in REGIONS:
        table.add_column(f"point {region}", justify="right")
        table.add_column("paper", justify="right", style="dim")
    shares = recognised(results)
    for g, gesture in enumerate(GESTURES):
        cells: list[str] = []
        for r, region in enumerate(REGIONS):
            cells += [_percent(shares[g][r]), f"{100 * table_1().share(gesture, region):.0f}"]
        table.add_row(gesture.replace("_", " "), *cells)
    return table


def answer_table(study: Study, results: Results) -> Table:
    """Table 2, by mode where more than one was run."""
    table = _table(f"Table 2: answers by hand and head, {study.trials} arrangements in each room, per cent")
    _add_rooms(table, results)
    modes = list(next(iter(results.values())).by_mode)
    for mode in modes:
        if len(modes) > 1:
            table.add_row(f"[bold]{mode}")
        cells: list[str] = []
        for name, result in results.items():
            cells += [f"{result.by_mode[mode].n_av:.3f}", f"{PUBLISHED[name].n_av:.2f}"]
        table.add_row("n_av", *cells)
        for row in TABLE_2:
            _add_row(table, row, {name: result.by_mode[mode] for name, result in results.items()})
    return table


def source_table(results: Results) -> Table:
    """Table 3."""
    table = _table("Table 3: by a single source, per cent")
    _add_rooms(table, results)
    for row in TABLE_3:
        _add_row(table, row, {name: result.by_mode["paper"] for name, result in results.items()})
    return table


def mismatch_table(study: Study, results: Results) -> Table:
    """What each rule does with heads that look at the robot, all rooms together."""
    table = _table(f"{study.mismatch:.0%} of the heads look at the robot: answers with a belief above .9, per cent")
    columns = ("wrong above .9", "answers above .9", "answers", "wrong of these")
    for column in (*columns, *(f"wrong in {name}" for name in results)):
        table.add_column(column, justify="right", no_wrap=True)
    for rule in next(iter(results.values())).by_rule:
        counts = of_rule(results, rule)
        by_room = [_share_of_sure(result.by_rule[rule]) for result in results.values()]
        table.add_row(
            rule,
            _percent(counts.wrong_of_sure, 2),
            f"{100 * counts.sure / counts.trials:.1f}",
            f"{100 * counts.answered / counts.trials:.1f}",
            _percent(Proportion(counts.wrong, counts.answered)),
            *by_room,
        )
    return table


def _share_of_sure(counts: RuleCounts) -> str:
    share = counts.wrong_of_sure.share
    return "-" if share is None else f"{100 * share:.2f}"


def _conflict_line(results: Results) -> str:
    said = [f"{value:.2f} where they are {name}" for name, value in conflicts(results).items() if value is not None]
    return f"Conflict mass 1 - K of hand and head by the paper's masses, mean: {', '.join(said)}."


def _add_rooms(table: Table, results: Results) -> None:
    for name in results:
        table.add_column(f"{name}", justify="right")
        table.add_column("paper", justify="right", style="dim")


def _add_row(table: Table, row: str, by_room: dict[str, Counts]) -> None:
    cells: list[str] = []
    for name, counts in by_room.items():
        ours, published = counts.share(row), PUBLISHED[name].share(row)
        mark = "*" if _apart(ours, published) else ""
        cells += [f"{_percent(ours)}{mark}", _percent(published)]
    table.add_row(row, *cells)


def _apart(one: Proportion, other: Proportion) -> bool:
    """Whether each share lies outside of the other's interval."""
    if one.share is None or other.share is None or one.interval is None or other.interval is None:
        return False
    return not (one.interval[0] <= other.share <= one.interval[1] or other.interval[0] <= one.share <= other.interval[1])


def _percent(proportion: Proportion, digits: int = 1) -> str:
    if proportion.share is None or proportion.interval is None:
        return "-"
    low, high = proportion.interval
    return f"{100 * proportion.share:.{digits}f} ({100 * low:.{digits}f}-{100 * high:.{digits}f})"


def _table(title: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left")
    table.add_column("", no_wrap=True)
    return table


def _say(console: Console, text: str) -> None:
    console.print(text, style="dim", markup=False, highlight=False, soft_wrap=True)
