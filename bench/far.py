"""People far away in large frames: how many faces the tracker finds there, how soon, and at what cost.

usage: python bench/far.py [--clips DIR] [--shrunk S ...] [--frames N] [--beside TREE] [--json FILE]

Labelled clips (by default examples/clips) are put into the middle of frames of 1920 x 1080, shrunk by S (by default 1, 0.6 and
0.4), their rims drawn out to the borders, and the tracker's core sees the first N frames of each (by default 45: a second and a
half, in which somebody has to be found). Of all clips:
* faces_S: of the faces with 60 visible pixels or more, the share that has a face track within a face's width of its head;
* false_S: face tracks on nobody; first_S: the frame, in the mean, in which the first face was found, N where none was;
* cpu_ms_S: processor time a frame, one thread of OpenCV.
--beside TREE measures another source tree's tracker too, by a run of its own; its figures begin with beside_.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from deixis_evaluation.clips import Clip, ClipError, TruePerson, load_clips
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_evaluation.replay import Given, Picture, ReplayError
from deixis_schemas.messages import Track
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker
from rich import box
from rich.console import Console
from rich.table import Table

CLIPS = Path(__file__).resolve().parents[1] / "examples" / "clips"
WIDTH, HEIGHT = 1920, 1080
SHRUNK, FRAMES = (1.0, 0.6, 0.4), 45
LEAST_FACE_PX = 60
NAMES = ("faces", "false", "first", "cpu_ms")
Figures = dict[str, float]


@dataclass
class Found:
    """Counts of all clips at one size."""

    faces: int = 0
    seen: int = 0
    false: int = 0
    firsts: list[int] = field(default_factory=list)
    frames: int = 0
    spent_s: float = 0.0

    def figures(self, shrunk: float) -> Figures:
        """The figures of the table."""
        values = (
            self.seen / max(1, self.faces),
            float(self.false),
            sum(self.firsts) / max(1, len(self.firsts)),
            1e3 * self.spent_s / max(1, self.frames),
        )
        return {f"{name}_{shrunk:g}": value for name, value in zip(NAMES, values, strict=True)}


def measure(clips: list[Clip], shrunk: float, frames: int) -> Figures:
    """Play all clips at one size. Raises ReplayError."""
    found = Found()
    for clip in clips:
        _play(clip, shrunk, frames, found)
    return found.figures(shrunk)


def _play(clip: Clip, shrunk: float, frames: int, found: Found) -> None:
    tracker, first = Tracker(TrackerConfig()), frames
    for frame, picture in Given(clip).pictures():
        if frame.seq >= frames:
            break
        large, corner = placed(picture, shrunk)
        begun_s = time.process_time()
        tracks = tracker.update(large, frame.run, frame.stamp_ns)
        found.spent_s += time.process_time() - begun_s
        found.frames += 1
        faces = [track for track in tracks if track.kind == "face"]
        persons = clip.truth.frames[frame.seq].persons
        widths = {person.id: clip.truth.face_width_px(person) * shrunk for person in persons}

        def lies_on(
            track: Track, person: TruePerson, corner: tuple[int, int] = corner, widths: dict[int, float] = widths
        ) -> bool:
            at = [of + shrunk * value for of, value in zip(corner, person.head.center_px, strict=True)]
            return math.dist(track.centroid_px, at) <= widths[person.id]

        visible = [person for person in persons if person.face.visible_px * shrunk**2 >= LEAST_FACE_PX]
        seen = sum(any(lies_on(track, person) for track in faces) for person in visible)
        found.faces, found.seen = found.faces + len(visible), found.seen + seen
        found.false += sum(not any(lies_on(track, person) for person in persons) for track in faces)
        first = min(first, frame.seq) if seen else first
    if any(frame.persons for frame in clip.truth.frames[:frames]):
        found.firsts.append(first)


def placed(picture: Picture, shrunk: float) -> tuple[Picture, tuple[int, int]]:
    """A picture in the middle of a large frame, and where its corner is. Raises ReplayError where it does not fit."""
    size = round(picture.shape[1] * shrunk), round(picture.shape[0] * shrunk)
    if size[0] > WIDTH or size[1] > HEIGHT:
        raise ReplayError(f"a picture of {size[0]} x {size[1]} does not fit into {WIDTH} x {HEIGHT}")
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    left, top = (WIDTH - size[0]) // 2, (HEIGHT - size[1]) // 2
    right, below = WIDTH - size[0] - left, HEIGHT - size[1] - top
    return np.asarray(cv2.copyMakeBorder(small, top, below, left, right, cv2.BORDER_REPLICATE), np.uint8), (left, top)


def beside(tree: Path, given: argparse.Namespace) -> Figures:
    """The figures of another source tree's tracker. Raises ReplayError."""
    path = tree.resolve() / "services" / "tracker"
    if not (path / "deixis_tracker").is_dir():
        raise ReplayError(f"--beside {tree}: not a source tree of Deixis (services/tracker/deixis_tracker)")
    with TemporaryDirectory() as folder:
        told = Path(folder) / "told.json"
        sizes = [option for shrunk in given.shrunk for option in ("--shrunk", str(shrunk))]
        command = [sys.executable, __file__, "--clips", str(given.clips), "--frames", str(given.frames), "--json", str(told)]
        environment = {**os.environ, "PYTHONPATH": str(path)}
        done = subprocess.run([*command, *sizes], capture_output=True, text=True, check=False, env=environment)
        if done.returncode != 0:
            raise ReplayError(f"--beside {tree}: {done.stderr.strip() or 'no reason given'}")
        figures: Figures = json.loads(told.read_text(encoding="utf-8"))["figures"]
    return {f"beside_{name}": value for name, value in figures.items()}


def table_of(figures: Figures, sizes: list[float]) -> Table:
    """A row for each size and tree."""
    table = Table(
        "shrunk", "tracker", title=f"Faces in frames of {WIDTH} x {HEIGHT}", title_justify="left", box=box.SIMPLE_HEAD
    )
    for column in ("faces found", "false", "first frame", "ms a frame"):
        table.add_column(column, justify="right")
    for shrunk in sizes:
        for tree, prefix in (("this", ""), ("beside", "beside_")):
            values = [figures.get(f"{prefix}{name}_{shrunk:g}") for name in NAMES]
            if values[0] is not None:
                table.add_row(f"{shrunk:g}", tree, f"{100 * values[0]:.0f} %", *(f"{value:.1f}" for value in values[1:]))
    return table


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, default=CLIPS, metavar="DIR", help="labelled clips (default: %(default)s)")
    parser.add_argument("--shrunk", type=float, action="append", metavar="S", help="size of the clip; may be given again")
    parser.add_argument("--frames", type=int, default=FRAMES, metavar="N", help="of each clip (default: %(default)s)")
    parser.add_argument("--beside", type=Path, metavar="TREE", help="source tree whose tracker plays, too")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    given.shrunk = given.shrunk or list(SHRUNK)
    if not all(0.1 <= shrunk <= 2 for shrunk in given.shrunk) or given.frames < 1:
        parser.error("--shrunk: from 0.1 to 2; --frames: at least 1")
    cv2.setNumThreads(1)  # as the stage does
    figures: Figures = {}
    try:
        clips = load_clips(given.clips)
        for shrunk in given.shrunk:
            figures |= measure(clips, shrunk, given.frames)
        if given.beside is not None:
            figures |= beside(given.beside, given)
    except (ClipError, ReplayError) as error:
        print(f"bench/far: {error}", file=sys.stderr)
        return 1
    machine, console = describe_machine(), Console()
    console.print(table_of(figures, given.shrunk))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
