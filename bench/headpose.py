"""Head pose methods beside each other, for error and for time: on labelled clips and on real people, all in one run.

usage: python bench/headpose.py [DIR | --seeds A:B] [--methods NAME,...] [--set NAME=VALUE] [--real DATA] [--json FILE]
                                [--mediapipe-python PATH | --no-mediapipe] [--out DIR]

The tracker's core runs once on each clip, and every method sees the same frames and tracks:
* those of Deixis, by the headpose setting `method`, with --set on top;
* ecc: cv2.findTransformECC on the face patch, its turn read off the affine map (affine_alignment.py);
* facemesh, facemesh_pnp: MediaPipe's FaceMesh, the yaw of its own axes and that of solvePnP on a generic head.

* On labelled clips (default: DATA/rendered), by |true yaw|: mean error of the yaw, and share of heads answered; the file has
  also how far outward the error is. Silent errors: of the answers, those more than 20 degrees off with a sigma below 10, or
  with none. Processor time by face and frame, of the method alone, on one thread.
* On signers (DATA/asl_clips), MediaPipe as referee, medians over the clips: median difference from it where it sees less than
  45 degrees, its constant part and the rest, share of its frames in which the method answers, share of differences within the
  intervals of 68 and 95 %; and the median difference of the worst clip.
* On drivers (DATA/drivface), labelled in steps of 15 degrees: share of pairs of differently labelled pictures of one driver in
  the right order, share of signs right among labels that are not 0, mean error.

MediaPipe runs in an interpreter of its own, with bench/requirements.txt. --out keeps what it said for the next run.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import cv2
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.clips import Box, Clip, ClipError
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_evaluation.matching import FACE_MARGIN
from deixis_evaluation.replay import ReplayError
from deixis_evaluation.seeds import SeedsError
from deixis_runtime.settings import ConfigError
from headpose_figures import BANDS, INTERVALS, Figures, Labels, agreement, nearest, score_clip, steps
from headpose_inputs import (
    Footage,
    Labelled,
    Source,
    clip_source,
    driver_source,
    footage_of,
    footage_of_clip,
    labelled_drivers,
    signer_sources,
)
from headpose_methods import ECC, MESH, MESH_PNP, Answers, Method, deixis_methods, maker_of, run
from mediapipe_answers import RefereeError, answers_of, ask
from real_people import is_there
from rich import box
from rich.console import Console
from rich.table import Table

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
Measured = dict[str, Figures]


@dataclass(frozen=True)
class Material:
    """What is measured on."""

    clips: list[Clip]
    signers: list[Source]
    drivers: dict[str, list[Labelled]]

    def sources(self) -> list[Source]:
        """All of it."""
        drivers = [driver_source(driver, pictures) for driver, pictures in self.drivers.items()]
        return [*(clip_source(clip) for clip in self.clips), *self.signers, *drivers]


@dataclass
class Methods:
    """What begins each method, by name: none for those of MediaPipe, whose answers are in `asked` (none: it was not asked)."""

    makers: dict[str, Callable[[], Method] | None]
    asked: dict[str, Any] | None

    def run(self, footage: Footage) -> dict[str, Answers]:
        """The answers of each method."""
        return {name: self._answers(name, make, footage) for name, make in self.makers.items()}

    def referee(self, footage: Footage) -> Answers | None:
        """What the referee says."""
        return None if self.asked is None else answers_of(MESH, footage, self.asked)

    def _answers(self, name: str, make: Callable[[], Method] | None, footage: Footage) -> Answers:
        if make is not None:
            return run(make, footage)
        assert self.asked is not None
        return answers_of(name, footage, self.asked)


def measure_clips(methods: Methods, clips: list[Clip]) -> Measured:
    """Figures against the labels, and time, by method."""
    labels = {name: Labels() for name in methods.makers}
    cpu_s, faces = dict.fromkeys(methods.makers, 0.0), 0
    for clip in clips:
        footage = footage_of_clip(clip)
        faces += footage.face_count
        for name, answers in methods.run(footage).items():
            score_clip(labels[name], clip.truth, answers.frames)
            cpu_s[name] += answers.cpu_s
    first = next(iter(cpu_s.values()), 0.0)
    return {
        name: {
            **labels[name].figures(),
            "cpu_ms": 1000 * cpu_s[name] / faces if faces else None,
            "cpu_by_first": cpu_s[name] / first if first else None,
        }
        for name in methods.makers
    }


def measure_signers(methods: Methods, sources: list[Source]) -> Measured:
    """Medians over the clips of the figures against the referee, by method, and the figures of each clip."""
    by_clip: dict[str, list[Figures]] = {name: [] for name in methods.makers}
    for source in sources:
        footage = footage_of(source)
        referee = methods.referee(footage)
        assert referee is not None
        for name, answers in methods.run(footage).items():
            by_clip[name].append(agreement(answers.frames, referee.frames))
    made: Measured = {}
    for name, figures in by_clip.items():
        clips = {source.name.partition("/")[2]: one["difference_deg"] for source, one in zip(sources, figures, strict=True)}
        made[name] = {key: _median([one[key] for one in figures]) for key in figures[0]}
        made[name] |= {f"difference_deg_{clip}": value for clip, value in clips.items()}
    return made


def measure_drivers(methods: Methods, drivers: dict[str, list[Labelled]]) -> Measured:
    """Figures against labels in steps, by method."""
    pairs: dict[str, list[list[tuple[float, float | None]]]] = {name: [] for name in methods.makers}
    for driver, pictures in drivers.items():
        footage = footage_of(driver_source(driver, pictures))
        for name, answers in methods.run(footage).items():
            last = answers.frames[footage.source.shown - 1 :: footage.source.shown]
            said = [
                nearest(frame, _middle(one.box), (0.5 + FACE_MARGIN) * one.box[2])
                for frame, one in zip(last, pictures, strict=True)
            ]
            yaws = [None if own is None else own.yaw_deg for own in said]
            pairs[name].append([(one.yaw_deg, yaw) for one, yaw in zip(pictures, yaws, strict=True)])
    return {name: steps(of_method) for name, of_method in pairs.items()}


def clips_table(measured: Measured) -> Table:
    """A row for each method: error and share answered by band, silent errors, time."""
    table = _table("Labelled clips: error and share answered by |true yaw|", *BANDS, "silent", "ms", "ratio")
    for name, figures in measured.items():
        bands = [f"{_said(figures[f'error_deg_{band}'])} {_share(figures[f'answered_share_{band}']):>4}" for band in BANDS]
        silent = figures["silent_share"]
        rest = (
            "-" if silent is None else f"{100 * silent:.1f}%",
            _said(figures["cpu_ms"], 2),
            _said(figures["cpu_by_first"], 2),
        )
        table.add_row(name, *bands, *rest)
    return table


def signers_table(measured: Measured) -> Table:
    """A row for each method: medians over the clips."""
    within = [f"in {percent}%" for percent in INTERVALS]
    columns = ("difference", "offset", "rest", "answered", *within, "worst")
    table = _table("Signers, MediaPipe as referee: medians over clips", *columns)
    for name, figures in measured.items():
        if name != MESH:  # which is the referee
            differences = (figures["difference_deg"], figures["offset_deg"], figures["rest_deg"])
            shares = (figures["answered_share"], *(figures[f"within_{percent}_share"] for percent in INTERVALS))
            worst = max((value for key, value in figures.items() if key.startswith("difference_deg_") and value), default=None)
            table.add_row(name, *(_said(one) for one in differences), *(_share(share) for share in shares), _said(worst))
    return table


def drivers_table(measured: Measured) -> Table:
    """A row for each method."""
    table = _table("Drivers, labels in steps of 15 degrees", "answered", "pairs in order", "signs right", "error")
    for name, figures in measured.items():
        shares = (figures["answered_share"], figures["ordered_share"], figures["sign_share"])
        table.add_row(name, *(_share(share) for share in shares), _said(figures["error_deg"]))
    return table


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("method", no_wrap=True)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table


def _said(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.0f}%"


def _median(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return median(known) if known else None


def _middle(box_px: Box) -> tuple[float, float]:
    x, y, w, h = box_px
    return x + w / 2, y + h / 2


# --- what is there --------------------------------------------------------------------------------------------------------


def material_of(given: argparse.Namespace, console: Console) -> Material:
    """What there is to measure on; what is not there is said. Raises ClipError or SeedsError."""
    clips: list[Clip] = []
    if given.clips or given.seeds:
        clips = list(choose(Choice(given.clips, given.seeds), console).clips)
    elif is_there("labelled clips", given.real / "rendered", console):
        clips = list(choose(Choice(given.real / "rendered", None), console).clips)
    signing, driving = given.real / "asl_clips", given.real / "drivface"
    signers = signer_sources(signing) if is_there("signers", signing, console) else []
    drivers = labelled_drivers(driving) if is_there("drivers", driving, console) else {}
    return Material(clips, signers, drivers)


def methods_of(given: argparse.Namespace, material: Material, console: Console) -> Methods:
    """The methods asked for; those of MediaPipe are left out, and that is said, where it cannot be asked.

    Raises ConfigError, and ValueError for a name that is none.
    """
    names = given.methods.split(",") if given.methods else [*deixis_methods(), ECC, MESH]
    makers = {name: maker_of(name, given.sets) for name in names if name not in (MESH, MESH_PNP)}
    asked = None
    if not given.no_mediapipe:
        try:
            asked = ask(material.sources(), given.mediapipe_python, given.out)
        except RefereeError as error:
            console.print(f"facemesh: left out. {error}", style="yellow", markup=False, soft_wrap=True)
    meshes = dict.fromkeys((MESH, MESH_PNP)) if asked is not None and {MESH, MESH_PNP} & set(names) else {}
    return Methods({**makers, **meshes}, asked)


def measure(methods: Methods, material: Material, console: Console) -> dict[str, Measured]:
    """Figures by method, by what they were measured on. Raises ReplayError or ValueError."""
    made: dict[str, Measured] = {}
    if material.clips:
        made["clips"] = measure_clips(methods, material.clips)
    if material.signers and methods.asked is None:
        console.print("signers: left out, for there is no referee", style="yellow")
    elif material.signers:
        made["signers"] = measure_signers(methods, material.signers)
    if material.drivers:
        made["drivers"] = measure_drivers(methods, material.drivers)
    return made


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument("clips", type=Path, nargs="?", metavar="DIR", help="folder of labelled clips (default: DATA/rendered)")
    source.add_argument("--seeds", metavar="A:B", help="clips of the simulator's seeds, made where they are missing")
    parser.add_argument("--methods", metavar="NAME,...", help=f"of {', '.join((*deixis_methods(), ECC, MESH))} (default: all)")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="sets", help="a headpose setting")
    parser.add_argument("--real", type=Path, default=DATA, metavar="DATA", help="real people (default: %(default)s)")
    mediapipe = parser.add_mutually_exclusive_group()
    mediapipe.add_argument("--mediapipe-python", type=Path, metavar="PATH", help="interpreter that has MediaPipe")
    mediapipe.add_argument("--no-mediapipe", action="store_true", help="neither as a method nor as the referee")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for what MediaPipe said, used by the next run")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    return parser


def main(argv: list[str] | None = None) -> int:
    given = _parser().parse_args(argv)
    cv2.setNumThreads(1)  # as the stage does
    said = Console(stderr=True)
    try:
        if given.out is not None:
            given.out.mkdir(parents=True, exist_ok=True)
        material = material_of(given, said)
        measured = measure(methods_of(given, material, said), material, said)
    except (ClipError, SeedsError, ReplayError, ConfigError, ValueError, OSError) as error:
        print(f"bench/headpose: {error}", file=sys.stderr)
        return 1
    if not measured:
        print("bench/headpose: nothing to measure", file=sys.stderr)
        return 1
    machine, console = describe_machine(), Console()
    for name, table in (("clips", clips_table), ("signers", signers_table), ("drivers", drivers_table)):
        if name in measured:
            console.print(table(measured[name]))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        flat = {
            f"{on}_{method}_{key}": value for on, m in measured.items() for method, f in m.items() for key, value in f.items()
        }
        given.json.write_text(json.dumps({"machine": machine, "figures": flat}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
