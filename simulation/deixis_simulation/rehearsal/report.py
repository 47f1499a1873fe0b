"""A rehearsal on the screen and as JSON. The JSON file's keys are documented here and stay:

`site`, `seed`, `count`, `complete` (false: broken off), `seconds`, `notes` (what is drawn otherwise than the site is),
`summary` (`pointings`, `named`, `told_apart`, `pois`, `quiet`, `quiet_answered`, `extra_answers`), and
* `places.LETTER`: `position_m` (site's map), `face_px`, and `pois.ID`: `azimuth_deg` (at the person from the line to the
  camera, positive toward the person's own left), `hidden` (wall, behind, here, or null), `hand_in_picture`, `answers`: a list
  of `poi_ids` (what was answered) and `times`;
* `pois.ID`: `name`, `verdict` (told_apart, tied, confused, untried), `tries`, `named`, `in_set`, `missed`, `wrong`,
  `named_share`, `interval` (Wilson, 95 %), `confused_with` and `causes` (name: times);
* `close_pairs`: `place`, `pois`, `gap_deg`; `advice`: `topic`, `text`, `pois`, `places`; `failures`: `trial`, `reason`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .advice import Advice, instead
from .aims import Aim, close_pairs, face_px
from .confusion import Confusion, PoiResult, Verdict
from .ground import Ground
from .places import Place

STYLES: dict[Verdict, str] = {"told_apart": "green", "tied": "yellow", "confused": "red", "untried": "dim"}
WORDS: dict[Verdict, str] = {"told_apart": "told apart", "tied": "tied", "confused": "confused", "untried": "not tried"}
HIDDEN_SIGNS = {"wall": "wall", "behind": "back", "here": "here"}


def print_report(console: Console, places: Sequence[Place], confusion: Confusion, advice: Sequence[Advice]) -> None:
    """Table, sentences, and the line that matters."""
    console.print(result_table(places, confusion))
    print_advice(console, advice)
    apart = sum(result.verdict == "told_apart" for result in confusion.results)
    style = "bold green" if confusion.all_told_apart else "bold yellow"
    told = f"Told apart: {apart} of {len(confusion.results)} points of interest."
    named = f"Named: {confusion.named} of {confusion.tries} pointings."
    console.print(f"{told} {named}", style=style, highlight=False, soft_wrap=True)


def print_advice(console: Console, advice: Sequence[Advice]) -> None:
    """The sentences, one below the other."""
    grid = Table.grid(padding=(0, 1))
    for item in advice:
        grid.add_row(" •", escape(item.text))
    if advice:
        console.print(grid, highlight=False)
        console.print()


def plan_table(places: Sequence[Place], aims: Sequence[Aim]) -> Table:
    """Bearing of each POI from each place; what hides it where it is hidden."""
    table = _table("Bearings at the person, degrees; + toward the person's own left", places)
    for name, views in _rows(places, aims):
        table.add_row(escape(name), *(_bearing(aim) for aim in views))
    return table


def result_table(places: Sequence[Place], confusion: Confusion) -> Table:
    """A row for each POI: how it stands, its share, and each place."""
    table = Table(box=box.SIMPLE_HEAD, title="Points of interest", title_justify="left")
    table.add_column("POI")
    table.add_column("", no_wrap=True)
    table.add_column("named", justify="right", no_wrap=True)
    table.add_column("95 %", justify="right", no_wrap=True, style="dim")
    for place in places:
        table.add_column(place.words.replace(" (", "\n("), justify="center", no_wrap=True)
    table.add_column("answered instead")
    names = {result.poi.poi_id: result.poi.name for result in confusion.results}
    for result in confusion.results:
        cells = [_at_place(confusion.at_places.get((place.letter, result.poi.poi_id))) for place in places]
        state = f"[{STYLES[result.verdict]}]{WORDS[result.verdict]}[/]"
        table.add_row(escape(result.poi.name), state, *_share(result), *cells, escape(instead(result, names)))
    return table


def report(
    ground: Ground,
    places: Sequence[Place],
    aims: Sequence[Aim],
    confusion: Confusion | None,
    advice: Sequence[Advice],
    *,
    complete: bool,
    **given: object,
) -> dict[str, Any]:
    """The content of the JSON file; `given` are further keys of its top. Without `confusion` only the plan is in it."""
    content: dict[str, Any] = {
        "site": ground.name,
        **given,
        "complete": complete,
        "notes": list(ground.notes),
        "places": {place.letter: _place(ground, place, aims, confusion) for place in places},
        "close_pairs": [
            {"place": pair.place.letter, "pois": [pair.first.poi_id, pair.second.poi_id], "gap_deg": round(pair.gap_deg, 1)}
            for pair in close_pairs(aims)
        ],
        "advice": [asdict(item) for item in advice],
    }
    if confusion is not None:
        content["summary"] = _summary(confusion)
        content["pois"] = {result.poi.poi_id: _poi(result) for result in confusion.results}
        content["failures"] = [{"trial": trial, "reason": reason} for trial, reason in confusion.failures]
    return content


def _table(title: str, places: Sequence[Place]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left")
    table.add_column("POI")
    for place in places:
        table.add_column(place.words, justify="right", no_wrap=True)
    return table


def _rows(places: Sequence[Place], aims: Sequence[Aim]) -> list[tuple[str, list[Aim]]]:
    pois = dict.fromkeys(aim.poi for aim in aims)
    found = {(aim.place.letter, aim.poi.poi_id): aim for aim in aims}
    return [(poi.name, [found[place.letter, poi.poi_id] for place in places]) for poi in pois]


def _bearing(aim: Aim) -> str:
    if aim.hidden is not None:
        return f"[dim]{HIDDEN_SIGNS[aim.hidden]}[/]"
    return f"{aim.azimuth_deg:+.0f}" if aim.hand_in_picture else f"[yellow]{aim.azimuth_deg:+.0f} hand out[/]"


def _share(result: PoiResult) -> tuple[str, str]:
    if not result.tries:
        return "-", ""
    low, high = result.interval
    return f"{result.outcomes['named']} of {result.tries}", f"{100 * low:.0f}-{100 * high:.0f}"


def _at_place(result: PoiResult | None) -> str:
    """Named of tried at one place; a dash where it is hidden."""
    if result is None or not result.tries:
        return "[dim]-[/]"
    return f"[{STYLES[result.verdict]}]{result.outcomes['named']}/{result.tries}[/]"


def _summary(confusion: Confusion) -> dict[str, int]:
    return {
        "pointings": confusion.tries,
        "named": confusion.named,
        "told_apart": sum(result.verdict == "told_apart" for result in confusion.results),
        "pois": len(confusion.results),
        "quiet": confusion.quiet,
        "quiet_answered": confusion.quiet_answered,
        "extra_answers": confusion.extra_answers,
    }


def _place(ground: Ground, place: Place, aims: Sequence[Aim], confusion: Confusion | None) -> dict[str, Any]:
    return {
        "position_m": [round(value, 3) for value in place.in_map_m],
        "face_px": round(face_px(ground, place), 1),
        "pois": {aim.poi.poi_id: _aim(aim, confusion) for aim in aims if aim.place == place},
    }


def _aim(aim: Aim, confusion: Confusion | None) -> dict[str, Any]:
    matrix = confusion.matrix if confusion is not None else {}
    answers = matrix.get((aim.place.letter, aim.poi.poi_id), Counter())
    return {
        "azimuth_deg": round(aim.azimuth_deg, 1),
        "hidden": aim.hidden,
        "hand_in_picture": aim.hand_in_picture,
        "answers": [{"poi_ids": sorted(poi_ids), "times": times} for poi_ids, times in answers.items()],
    }


def _poi(result: PoiResult) -> dict[str, Any]:
    return {
        "name": result.poi.name,
        "verdict": result.verdict,
        "tries": result.tries,
        **{name: result.outcomes[name] for name in ("named", "in_set", "missed", "wrong")},
        "named_share": result.named_share,
        "interval": [round(end, 4) for end in result.interval],
        "confused_with": dict(result.confused_with),
        "causes": dict(result.causes),
    }
