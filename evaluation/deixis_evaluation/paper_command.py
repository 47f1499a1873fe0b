"""`deixis paper`: the simulation of Pateraki et al. 2011, section 7.2, and its tables 1 to 3, ours beside the published ones.

With `--mode deixis` our rules answer the same trials. With `--mismatch` some of the heads look at the robot, and each rule of
combination shows how often it is sure and wrong. What the paper leaves open is listed with the tables.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError, stage_settings
from deixis_fusion.config import FusionConfig
from deixis_runtime.interrupts import Interrupts
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from .core_config import core_config
from .json_file import check_writable, write_json
from .machine import describe_machine, say_machine
from .paper_report import report
from .paper_rooms import ROOMS
from .paper_simulation import RoomResult, Simulation, Study
from .paper_tables import print_paper

TABLE_WIDTH = 150
"""Of a table that goes to a file: a terminal has its own."""
MOST_TRIALS = 100_000_000
MOST_SEED = 2**63 - 1


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("paper", help="the paper's tables, ours beside the published ones", description=__doc__)
    parser.add_argument(
        "--trials", type=_number(1, MOST_TRIALS), default=1000, metavar="N", help="in each room (default: 1000)"
    )
    parser.add_argument("--seed", type=_number(0, MOST_SEED), default=1, metavar="S", help="other trials (default: 1)")
    parser.add_argument("--mode", choices=("paper", "deixis"), default="paper", help="whose rules answer (default: paper)")
    parser.add_argument(
        "--mismatch", type=_share, default=0.0, metavar="SHARE", help="so many heads look at the robot, 0 to 1, e.g. 0.2"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="sets",
        metavar="fusion.NAME=VALUE",
        help="override a setting of fusion, e.g. fusion.paper.phi_f_max_deg=110 or fusion.confusion.hand=FILE",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="draw figures 5 to 8 there, as PNG")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to this file")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Simulate and tell; 0. Raises CommandError for what cannot be simulated, drawn or written."""
    study = Study(given.trials, given.seed, given.mode, given.mismatch, _config(given.sets))
    check_writable(given.json)
    draw = _drawer(given.out)
    started = time.perf_counter()
    results, done, stopped = _simulate(study)
    if not done and stopped is not None:
        print("deixis paper: stopped before the first trials were done", file=sys.stderr)
        return 128 + stopped
    study = replace(study, trials=done)
    seconds = time.perf_counter() - started
    console, machine = Console(), describe_machine()
    if not console.is_terminal:
        console.width = TABLE_WIDTH
    print_paper(console, study, results)
    per_room = seconds / len(ROOMS)
    console.print(
        f"{seconds:.2f} s, {per_room:.2f} s a room; {say_machine(machine)}", style="dim", highlight=False, soft_wrap=True
    )
    write_json(given.json, report(study, results, seconds, given.sets, machine))
    draw(study)
    if stopped is not None:
        said = f"stopped after {done} of {given.trials} trials in each room; the figures are of these"
        print(f"deixis paper: {said}", file=sys.stderr)
        return 128 + stopped
    return 0


def _simulate(study: Study) -> tuple[dict[str, RoomResult], int, int | None]:
    """The results, the trials that each room had, and the signal that stopped it."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("trials"), TimeRemainingColumn())
    with Interrupts() as interrupts, Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("three rooms", total=study.trials * len(ROOMS))
        results, done = Simulation(study).run_all(lambda count: progress.advance(task, count), interrupts.requested)
    return results, done, interrupts.signal if done < study.trials else None


def _config(sets: list[str]) -> FusionConfig:
    settings = stage_settings(sets)
    others = sorted(set(settings) - {"fusion"})
    if others:
        raise CommandError(f"--set {others[0]}: the simulation has fusion's settings alone")
    return core_config("fusion", FusionConfig, settings)


def _drawer(out: Path | None) -> Callable[[Study], None]:
    """What draws the figures; the folder is made. Matplotlib is loaded here alone. Raises CommandError where it cannot be."""
    if out is None:
        return lambda _study: None
    try:
        out.mkdir(parents=True, exist_ok=True)
        from .paper_plots import draw_figures  # noqa: PLC0415
    except OSError as error:
        raise CommandError(f"--out {out}: {error.strerror}") from None
    except ImportError as error:
        hint = "pip install 'deixis-evaluation[plots]'"
        raise CommandError(f"--out draws with matplotlib, which cannot be loaded: {error} ({hint})") from None
    return lambda study: draw_figures(out, study)


def _number(least: int, most: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        if not (text.isascii() and text.isdigit() and len(text) < 20 and least <= int(text) <= most):
            raise argparse.ArgumentTypeError(f"'{text[:40]}': not a whole number from {least} to {most}")
        return int(text)

    return read


def _share(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"'{text[:40]}': not a share from 0 to 1")
    return value
