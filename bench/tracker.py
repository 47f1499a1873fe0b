"""The tracker's cost by step: processor time of its core a VGA frame, beside MediaPipe's faces and hands, in one run.

usage: python bench/tracker.py [--clip FILE ...] [--rounds N] [--mediapipe-python P] [--beside TREE] [--json FILE]

Plays examples/clips/pointing.mp4 (one person) and two_persons.mp4 (two), decoded ahead, in a process of its own with one thread
of OpenCV. Each of the N rounds plays all contestants in turn, and of each the round counts in which it took least: others on
the machine only ever add to it. Compare ratios within one run; milliseconds are this machine's, at this hour.
* cpu_ms_CLIP, and cpu_ms_CLIP_STEP: user and system time a frame, of all and of each step (bench/tracker_steps.py says which
  functions it has; a step's time is its own, without that of steps inside it);
* mediapipe_cpu_ms_CLIP, also _faces and _hands: MediaPipe's full-range face detector and hand landmarks, of all their threads;
  mediapipe_ratio_CLIP: how many times as long as the tracker they take. --mediapipe-python names an interpreter that has
  bench/requirements.txt; without it MediaPipe is left out, and that is said;
* beside_cpu_ms_CLIP, beside_ratio_CLIP: the same for the tracker of another source tree (git worktree add TREE COMMIT), and
  beside_same_CLIP: 1 where both answer the same to the last digit.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from deixis_evaluation.machine import describe_machine, say_machine
from rich import box
from rich.console import Console
from rich.table import Table

BENCH = Path(__file__).resolve().parent
CLIPS = [BENCH.parent / "examples" / "clips" / f"{name}.mp4" for name in ("pointing", "two_persons")]
MOST_PERSONS = 2
"""In these clips; MediaPipe looks for two hands of each."""
ROUNDS, TIMEOUT_S = 3, 900
TABLE_WIDTH = 120
"""Of a table that goes to a file: a terminal has its own."""
OURS, OTHER_TREE, MEDIAPIPE = "tracker", "beside", "mediapipe"
Answers = dict[str, dict[str, Any]]


class BenchError(RuntimeError):
    """A contestant that did not answer; the text says which and why."""


class Contestant:
    """A program that plays clips and answers with what they cost."""

    def __init__(self, name: str, command: Sequence[str], path: Path | None = None) -> None:
        """`path` comes first among the folders that its modules are looked for in."""
        self._name = name
        self._command = list(command)
        self._path = path
        self.best: Answers = {}

    def play(self, clips: Sequence[Path]) -> None:
        """Play all clips once; of each the cheapest round is kept. Raises BenchError."""
        for clip, answer in self._run([str(clip) for clip in clips]).items():
            if clip not in self.best or answer["cpu_ms"] < self.best[clip]["cpu_ms"]:
                self.best[clip] = answer

    def _run(self, clips: list[str]) -> Answers:
        environment = dict(os.environ) if self._path is None else {**os.environ, "PYTHONPATH": str(self._path)}
        try:
            done = subprocess.run(
                [*self._command, *clips], capture_output=True, text=True, timeout=TIMEOUT_S, check=False, env=environment
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise BenchError(f"{self._name}: {error}") from None
        if done.returncode != 0:
            raise BenchError(f"{self._name}: {(done.stderr.strip().splitlines() or ['no reason given'])[-1]}")
        answers: Answers = json.loads(done.stdout)
        return answers


def contestants(given: argparse.Namespace) -> dict[str, Contestant]:
    """Who plays, by name. Raises BenchError."""
    ours = [sys.executable, str(BENCH / "tracker_steps.py")]
    found = {OURS: Contestant(OURS, ours)}
    if given.beside is not None:
        tree = given.beside.resolve() / "services" / "tracker"
        if not (tree / "deixis_tracker").is_dir():
            raise BenchError(f"--beside {given.beside}: not a source tree of Deixis (services/tracker/deixis_tracker)")
        found[OTHER_TREE] = Contestant(f"--beside {given.beside}", ours, tree)
    if given.mediapipe_python is not None:
        command = [str(given.mediapipe_python), str(BENCH / "mediapipe_tracker.py"), str(MOST_PERSONS)]
        found[MEDIAPIPE] = Contestant(f"--mediapipe-python {given.mediapipe_python}", command)
    return found


def figures_of(best: dict[str, Answers]) -> dict[str, float]:
    """All figures, flat; `best` by contestant and clip."""
    figures: dict[str, float] = {}
    for clip, ours in best[OURS].items():
        name = Path(clip).stem
        figures[f"cpu_ms_{name}"] = ours["cpu_ms"]
        figures |= {f"cpu_ms_{name}_{_key(step)}": spent for step, spent in ours["steps"].items()}
        for other in (other for other in (OTHER_TREE, MEDIAPIPE) if other in best):
            answer = best[other][clip]
            figures |= {f"{other}_{key.replace('cpu_ms', f'cpu_ms_{name}')}": answer[key] for key in answer if "cpu_ms" in key}
            figures[f"{other}_ratio_{name}"] = answer["cpu_ms"] / ours["cpu_ms"]
        if OTHER_TREE in best:
            figures[f"beside_same_{name}"] = float(best[OTHER_TREE][clip]["digest"] == ours["digest"])
    return figures


def steps_table(best: dict[str, Answers]) -> Table:
    """A row for each step, and one for all; of each clip milliseconds a frame, share, and what another tree takes."""
    table = Table(title="Tracker, ms of the processor a frame", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("step")
    ours, beside = best[OURS], best.get(OTHER_TREE)
    for clip in ours:
        table.add_column(Path(clip).stem, justify="right")
        table.add_column("share", justify="right")
        if beside is not None:
            table.add_column("beside", justify="right")
            table.add_column("ratio", justify="right")
    steps = next(iter(ours.values()))["steps"]

    def row(name: str, spent: Callable[[dict[str, Any]], float]) -> list[str]:
        cells = [name]
        for clip, answer in ours.items():
            cells += [f"{spent(answer):.2f}", f"{100 * spent(answer) / answer['cpu_ms']:.0f} %"]
            if beside is not None:
                theirs = spent(beside[clip])
                cells += [f"{theirs:.2f}", f"{theirs / spent(answer):.2f}" if spent(answer) > 0 else "-"]
        return cells

    for step in sorted(steps, key=lambda step: -max(answer["steps"][step] for answer in ours.values())):
        table.add_row(*row(step, lambda answer, step=step: answer["steps"][step]))  # type: ignore[misc]
    table.add_section()
    table.add_row(*row("all", lambda answer: answer["cpu_ms"]))
    return table


def mediapipe_table(best: dict[str, Answers]) -> Table:
    """The tracker and MediaPipe side by side."""
    table = Table("clip", title="Beside MediaPipe, a frame", title_justify="left", box=box.SIMPLE_HEAD)
    for column in ("tracker ms", "MediaPipe ms", "its faces", "its hands", "ratio", "faces found", "its", "hands found", "its"):
        table.add_column(column, justify="right")
    for clip, ours in best[OURS].items():
        its = best[MEDIAPIPE][clip]
        costs = (ours["cpu_ms"], its["cpu_ms"], its["cpu_ms_faces"], its["cpu_ms_hands"], its["cpu_ms"] / ours["cpu_ms"])
        found = (ours["faces"], its["faces"], ours["hands"], its["hands"])
        table.add_row(Path(clip).stem, *(f"{value:.1f}" for value in costs), *(f"{value:.2f}" for value in found))
    return table


def _key(step: str) -> str:
    return step.replace("'", "").replace(" ", "_")


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clip", type=Path, action="append", metavar="FILE", help="another video; may be given again")
    parser.add_argument("--rounds", type=int, default=ROUNDS, metavar="N", help="how often all play (default: %(default)s)")
    parser.add_argument("--mediapipe-python", type=Path, metavar="P", help="interpreter that has MediaPipe")
    parser.add_argument("--beside", type=Path, metavar="TREE", help="source tree whose tracker plays, too")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    if not 1 <= given.rounds <= 100:
        parser.error("--rounds: from 1 to 100")
    try:
        playing = contestants(given)
        for _ in range(given.rounds):
            for contestant in playing.values():
                contestant.play(given.clip or CLIPS)
    except BenchError as error:
        print(f"bench/tracker: {error}", file=sys.stderr)
        return 1
    best = {name: contestant.best for name, contestant in playing.items()}
    machine, console, figures = describe_machine(), Console(), figures_of(best)
    if not console.is_terminal:
        console.width = TABLE_WIDTH
    console.print(steps_table(best))
    if MEDIAPIPE in best:
        console.print(mediapipe_table(best))
    else:
        print("bench/tracker: MediaPipe is left out; --mediapipe-python names an interpreter that has it", file=sys.stderr)
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
