"""`deixis rehearse`: will this site work? Rendered visitors point at each POI of a site file, the real system answers each of
them, and sentences and a map say which POIs are told apart, which are not, and what would help. Exit status: 0 when all POIs
are told apart, 3 when some are not, 1 when it could not be tried, 130 when stopped (what was tried until then is told).
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError, read_site, stage_settings
from deixis_evaluation.interrupted import Interrupted
from deixis_runtime.host import chosen_stages
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ..avatars import AVATARS
from ..jobs import Interrupted as RenderingInterrupted
from ..scene import Scene
from .advice import advise
from .aims import Aim, aims_of
from .answers import Answer
from .confusion import Confusion, confusion_of
from .floor_map import draw_map
from .ground import Ground, Point, RehearsalError, ground_of
from .performance import Venue, perform
from .places import MOST_PLACES, Place, chosen_places, given_places
from .report import plan_table, print_advice, print_report, report
from .trials import Trial, plan_trials

NOT_ALL_TOLD_APART = 3
STOPPED = 130
FAILURES_AT_FIRST = 3
MOST_TRIALS = 5000
RENDER_S_PER_MEGAPIXEL = 1.0
PLAY_S_PER_FRAME = 0.03
START_S_PER_CLIP = 4.0
"""Rough costs on one core, for the estimate before anything is measured: 11 VGA clips took 9 minutes of processor time."""
TABLE_WIDTH = 140
"""Of a table that goes to a file: a terminal has its own."""


@dataclass(frozen=True)
class Plan:
    """What is going to be tried."""

    ground: Ground
    places: list[Place]
    aims: list[Aim]
    trials: list[Trial]


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("rehearse", help="try a site with rendered visitors", description=__doc__)
    parser.add_argument("--site", type=Path, required=True, metavar="FILE", help="site file to rehearse")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="clips and map go there (default: rehearsal_SITE); clips are kept"
    )
    parser.add_argument("--count", type=_whole(1, 50), default=2, metavar="N", help="people per POI and place (default: 2)")
    parser.add_argument(
        "--from",
        action="extend",
        nargs="+",
        type=_point,
        default=[],
        dest="places_m",
        metavar="X,Y",
        help="where people stand, in the site's map, metres; before a minus sign write --from=-1,2 (default: chosen)",
    )
    parser.add_argument("--places", type=_whole(1, MOST_PLACES), default=3, metavar="N", help="places to choose (default: 3)")
    parser.add_argument("--seed", type=_whole(0, 2**31), default=1, metavar="S", help="of the visitors (default: 1)")
    parser.add_argument("--jobs", type=_whole(1, 64), default=os.cpu_count() or 1, metavar="J", help="clips rendered at a time")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all results to this file")
    parser.add_argument("--plan", action="store_true", help="say at once what geometry alone tells, and render nothing")
    parser.add_argument(
        "--set", action="append", default=[], dest="sets", metavar="STAGE.NAME=VALUE", help="override a setting of a stage"
    )
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Rehearse a site. See the module for the exit status. Raises CommandError or HostFailed."""
    plan = _plan(given)
    out = _folder(given)
    console = Console()
    if not console.is_terminal:
        console.width = TABLE_WIDTH
    _introduce(console, plan)
    if given.plan:
        return _tell_plan(console, given, plan, out)
    return _rehearse(console, given, plan, out)


def _plan(given: argparse.Namespace) -> Plan:
    site = read_site(given.site)
    if site is None:
        raise CommandError("--site: no site file")
    try:
        ground = ground_of(site)
        places = given_places(ground, given.places_m) if given.places_m else chosen_places(ground, given.places)
    except RehearsalError as error:
        raise CommandError(str(error)) from None
    aims = aims_of(ground, places)
    number = given.count * sum(aim.hidden is None for aim in aims) + len(places)
    if number > MOST_TRIALS:
        raise CommandError(f"that would be {number} clips, {MOST_TRIALS} at most: fewer places, or a smaller --count")
    return Plan(ground, places, aims, plan_trials(ground, aims, count=given.count, seed=given.seed, avatars=AVATARS))


def _folder(given: argparse.Namespace) -> Path:
    """The folder of clips and map. Refuses before an hour of work what cannot be written after it."""
    out: Path = given.out or Path(f"rehearsal_{given.site.stem}")
    try:
        (out / "clips").mkdir(parents=True, exist_ok=True)
        if given.json is not None:
            given.json.parent.mkdir(parents=True, exist_ok=True)
            given.json.open("a", encoding="utf-8").close()
    except OSError as error:
        raise CommandError(f"'{error.filename}' cannot be written: {error.strerror}") from None
    return out


def _introduce(console: Console, plan: Plan) -> None:
    where = ", ".join(place.words for place in plan.places)
    pois = f"{len(plan.ground.pois)} point{'s' if len(plan.ground.pois) > 1 else ''} of interest"
    console.print(f"[bold]{escape(plan.ground.name)}[/]: {pois}, people at {where}", highlight=False)
    for note in plan.ground.notes:
        console.print(f"  note: {escape(note)}", style="dim", highlight=False)


def _tell_plan(console: Console, given: argparse.Namespace, plan: Plan, out: Path) -> int:
    advice = advise(plan.ground, plan.aims, None)
    console.print(plan_table(plan.places, plan.aims))
    print_advice(console, advice)
    _write_map(console, out, plan, None)
    _write_json(
        given, report(plan.ground, plan.places, plan.aims, None, advice, complete=False, seed=given.seed, count=given.count)
    )
    return 0


def _rehearse(console: Console, given: argparse.Namespace, plan: Plan, out: Path) -> int:
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    venue = Venue(
        given.site.resolve(), plan.ground, plan.aims, out / "clips", chosen_stages((), ()), stage_settings(given.sets)
    )
    began_s = time.monotonic()
    answers: list[Answer] = []
    stopped = _perform(given, plan, venue, answers)
    if not answers:
        print("deixis rehearse: stopped before anything was answered", file=sys.stderr)
        return STOPPED
    confusion = confusion_of(plan.aims, answers, plan.ground.too_far)
    advice = advise(plan.ground, plan.aims, confusion)
    print_report(console, plan.places, confusion, advice)
    seconds = round(time.monotonic() - began_s, 1)
    told = {"seed": given.seed, "count": given.count, "seconds": seconds}
    _write_json(given, report(plan.ground, plan.places, plan.aims, confusion, advice, complete=not stopped, **told))
    _write_map(console, out, plan, confusion)
    return _status(confusion, stopped, len(answers), len(plan.trials))


def _perform(given: argparse.Namespace, plan: Plan, venue: Venue, answers: list[Answer]) -> bool:
    """Fill `answers`; whether it was stopped before the end."""
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    names = {trial.scene.name: trial.words for trial in plan.trials}
    left = {trial.scene.name: trial.scene.frames for trial in plan.trials}
    console = Console(stderr=True)
    with Progress(*columns, console=console, speed_estimate_period=600, disable=not console.is_terminal) as progress:
        minutes = math.ceil(estimate_s(plan.trials, given.jobs) / 60)
        say = functools.partial(console.print, markup=False, highlight=False, soft_wrap=True)
        say(f"{len(plan.trials)} clips, about {minutes} min with {given.jobs} jobs; Ctrl-C ends with what there is until then")
        task = progress.add_task("rendering", total=sum(left.values()))

        def hear(answer: Answer) -> None:
            answers.append(answer)
            refuse_to_go_on(answers)
            said = f"{len(answers)} of {len(left)}: {names[answer.trial]}: {in_words(answer)}"
            # Clips that were there already, or failed, have frames that nobody counted.
            progress.update(task, description=escape(said), advance=left[answer.trial])
            if not console.is_terminal:
                say(said)

        def tick(scene: Scene) -> None:
            left[scene.name] -= 1
            progress.advance(task)

        try:
            perform(plan.trials, venue, given.jobs, hear, tick)
        except (RenderingInterrupted, Interrupted, KeyboardInterrupt):
            return True
        except OSError as error:
            raise CommandError(f"'{venue.clips}': {error.strerror or error}") from None
    return False


def refuse_to_go_on(answers: list[Answer]) -> None:
    """Where nothing works at first, nothing will. Raises CommandError with the reason."""
    if len(answers) == FAILURES_AT_FIRST and all(answer.failure is not None for answer in answers):
        raise CommandError(f"none of the first {FAILURES_AT_FIRST} clips could be tried: {answers[-1].failure}")


def in_words(answer: Answer) -> str:
    """An answer in a word or two."""
    if answer.failure is not None:
        return "failed"
    if answer.asked is None:
        return "answered all the same" if answer.false_answers else "no answer, rightly"
    return {"named": "named", "in_set": "tied", "missed": "no answer", "wrong": "mistaken"}[answer.outcome or "missed"]


def estimate_s(trials: list[Trial], jobs: int) -> float:
    """About how long it takes, seconds: rendering in `jobs` processes, and playing meanwhile."""
    cores = min(jobs, os.cpu_count() or 1)
    frames = [trial.scene.frames for trial in trials]
    pixels = trials[0].scene.camera.width * trials[0].scene.camera.height if trials else 0
    render_s = sum(frames) * RENDER_S_PER_MEGAPIXEL * pixels / 1e6
    play_s = sum(frames) * PLAY_S_PER_FRAME + len(trials) * START_S_PER_CLIP
    return (render_s + play_s) / cores


def _write_map(console: Console, out: Path, plan: Plan, confusion: Confusion | None) -> None:
    path = out / "map.png"
    try:
        draw_map(path, plan.ground, plan.places, plan.aims, confusion)
    except OSError as error:
        raise CommandError(f"{path}: {error.strerror}") from None
    console.print(f"map: {path}", highlight=False, soft_wrap=True)


def _write_json(given: argparse.Namespace, content: dict[str, Any]) -> None:
    if given.json is not None:
        given.json.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _status(confusion: Confusion, stopped: bool, answered: int, wanted: int) -> int:
    if stopped:
        print(
            f"deixis rehearse: stopped after {answered} of {wanted} clips; the same command goes on from there", file=sys.stderr
        )
        return STOPPED
    if confusion.failures:
        print(f"deixis rehearse: {len(confusion.failures)} of {wanted} clips could not be tried", file=sys.stderr)
        return 1
    return 0 if confusion.all_told_apart else NOT_ALL_TOLD_APART


def _point(text: str) -> Point:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not X,Y in metres, e.g. 2.0,0.5") from None
    if not (abs(x) <= 1e5 and abs(y) <= 1e5):
        raise argparse.ArgumentTypeError(f"'{text}' lies nowhere on a map")
    return x, y


def _whole(least: int, most: int) -> Any:
    def whole(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"'{text[:20]}' is not a whole number from {least} to {most}")
        return int(text)

    return whole
