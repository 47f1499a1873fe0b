"""Real people judge the simulator: the same figures for real and for rendered heads and hands, side by side.

usage: python bench/real_people.py [--data DIR] [--simulated DIR | --seeds A:B] [--sample N] [--json FILE]

A rule that helps on rendered people and hurts on real ones is out. Of --data (../shared/data):
* asl_clips, people who sign: faces found and yaws answered, by frames; pointing episodes a minute, each of them false;
* drivface, drivers: the same, and the error against the yaw label (in steps of 15 degrees), each still shown for 3 frames;
* hgr1, hands with skin masks: skin found, background taken for skin (by the prior alone), and of hands that extend the index
  finger alone, how many show one finger; of those of all other signs, how many do all the same; the same by the posture that
  the stage calls, and in how many hands it is unknown;
* hands, hands with boxes: fingers and posture alone, on what differs from the colours around the box.
Beside them rendered clips: those of --simulated (by default DATA/rendered), or clips that the simulator makes of --seeds.
Fingers and skin need their label pictures. What is not there is left out, and that is said. --sample bounds the work: so many
rendered clips, and twenty times as many pictures of each set of hands, spread evenly.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import cv2
import real_hands
import real_heads
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.clips import Clip, ClipError
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_evaluation.seeds import SeedsError
from deixis_evaluation.true_tracks import label_pictures_of
from rich import box
from rich.console import Console
from rich.table import Table

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
SAMPLE = 24
PICTURES_A_CLIP = 20
Figures = dict[str, float | None]
Measured = dict[str, Figures]


def measure_heads(data: Path, clips: list[Clip], console: Console) -> Measured:
    """Figures of heads by source."""
    measured: Measured = {}
    for name, of, folder in (("signers", real_heads.signers, "asl_clips"), ("drivers", real_heads.drivers, "drivface")):
        if is_there(name, data / folder, console):
            measured[name] = of(data / folder).figures()
    if clips:
        measured["rendered"] = real_heads.rendered(clips).figures()
    return measured


def measure_hands(data: Path, clips: list[Clip], sample: int, console: Console) -> Measured:
    """Figures of hands by source."""
    measured: Measured = {}
    pictures = sample * PICTURES_A_CLIP
    for name, of in (("hgr1", real_hands.hgr1), ("hands", real_hands.boxed)):
        if is_there(name, data / name, console):
            measured[name] = of(data / name, pictures).figures()
    labelled = [clip for clip in clips if label_pictures_of(clip).exists()]
    if labelled:
        measured["rendered"] = real_hands.rendered(labelled).figures()
    elif clips:
        console.print("rendered hands: left out, for no clip has label pictures (deixis simulate --labels)", style="yellow")
    return measured


def rendered_clips(given: argparse.Namespace, console: Console) -> list[Clip]:
    """The rendered clips, at most --sample of them; none, and a word, where there are none. Raises ClipError or SeedsError."""
    folder = given.simulated or (None if given.seeds else given.data / "rendered")
    if folder is not None and not folder.is_dir():
        if given.simulated:
            raise ClipError(f"'{folder}' is not a folder of labelled clips")
        console.print(f"rendered: left out, for '{folder}' is not there", style="yellow", markup=False, soft_wrap=True)
        return []
    return real_hands.sampled(choose(Choice(folder, given.seeds), console).clips, given.sample)


def table_of(title: str, measured: Measured) -> Table:
    """One row for each figure, one column for each source."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("figure")
    for name in measured:
        table.add_column(name, justify="right")
    for figure in next(iter(measured.values()), {}):
        table.add_row(figure.replace("_", " "), *(_said(figure, figures[figure]) for figures in measured.values()))
    return table


def is_there(name: str, folder: Path, console: Console) -> bool:
    """Whether a set is there; where not, that is said."""
    if folder.is_dir():
        return True
    console.print(f"{name}: left out, for '{folder}' is not there", style="yellow", markup=False, soft_wrap=True)
    return False


def _said(figure: str, value: float | None) -> str:
    if value is None:
        return "-"
    if figure.endswith("_share"):
        return f"{100 * value:.1f} %"
    return f"{value:.0f}" if value.is_integer() else f"{value:.1f}"


def _flat(kind: str, measured: Measured) -> Figures:
    return {f"{kind}_{name}_{figure}": value for name, figures in measured.items() for figure, value in figures.items()}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA, metavar="DIR", help="folder of the real data (default: %(default)s)")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--simulated", type=Path, metavar="DIR", help="folder of rendered clips (default: DATA/rendered)")
    source.add_argument("--seeds", metavar="A:B", help="clips of the simulator's seeds, made where they are missing")
    parser.add_argument("--sample", type=int, default=SAMPLE, metavar="N", help="rendered clips at most (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    if given.sample < 1:
        parser.error("--sample: at least 1")
    cv2.setNumThreads(1)  # as the stages do
    said = Console(stderr=True)
    try:
        clips = rendered_clips(given, said)
        heads, hands = measure_heads(given.data, clips, said), measure_hands(given.data, clips, given.sample, said)
    except (ClipError, SeedsError, ValueError, OSError) as error:
        print(f"bench/real_people: {error}", file=sys.stderr)
        return 1
    if not heads and not hands:
        print(f"bench/real_people: nothing to measure in '{given.data}'", file=sys.stderr)
        return 1
    machine, console = describe_machine(), Console()
    for title, measured in (("Heads", heads), ("Hands", hands)):
        if measured:
            console.print(table_of(title, measured))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        figures = {**_flat("heads", heads), **_flat("hands", hands)}
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
