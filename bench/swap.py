"""What a hot swap costs: each stage that can be swapped is replaced N times in a running system, and all answers are counted.

usage: python bench/swap.py [--rounds N] [--stages NAMES] [--lockstep] [--rate HZ] [--source FILE] [--site FILE] [--json FILE]

Runs `deixis up` on the looped example, and has its supervisor replace tracker, headpose and gesture in turn, N times, as
`deixis swap` does; headpose is replaced by examples/swap_headpose.py, too (`headpose_guest`), whose end gives the place back.
Of each STAGE:
* STAGE_gap_frames_p50, _max: frames that came between the last answer of the old one and the first of the new one, answered by
  neither. The tracker is given each frame of the camera, headpose and gesture each message of the tracker.
* STAGE_gap_ms_p50, _max: from the one answer to the other; STAGE_usual_ms_p50: from one answer to the next, else.
* STAGE_twice: frames answered twice, over all rounds. Has to be 0, or the exit is 1.
* STAGE_unanswered_per_1000: of the frames that came while we listened; what a busy machine leaves out is in it.
* STAGE_takes_s_p50: from the command to the end of the old one; for WATCH_S the newcomer is watched.
* two_voices: lines in which a stage said that a key has more than one producer. Has to be 0, or the exit is 1.
Live, a busy machine leaves out frames, and its figures say little of a swap; --lockstep leaves out none, --rate asks for less.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import zenoh
from deixis_cli.gets import get_state
from deixis_cli.newcomer import Newcomer, OwnNewcomer, SupervisedNewcomer
from deixis_cli.options import CommandError
from deixis_cli.swap_count import Cost
from deixis_cli.swap_procedure import Refusal, SwapProcedure
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_runtime.session import Unreachable, open_client
from deixis_schemas import topics
from rich import box
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
ROBOT = "swap"
GUEST = "headpose_guest"
WATCH_S = 1.0
START_S = 120.0
FIRST_FRAMES = 30
TURN_S = 0.2


@dataclass(frozen=True)
class Swapped:
    """One swap: what it cost in answers, and how long it took."""

    cost: Cost
    took_s: float


@contextmanager
def running(given: argparse.Namespace, folder: Path) -> Iterator[tuple[zenoh.Session, str, Path]]:
    """`deixis up`, when it answers frames: a session, its endpoint, its log. Raises RuntimeError where it does not start."""
    endpoint, log = f"unixsock-stream/{folder}/bench.sock", folder / "log"
    argv = [
        Path(sys.executable).parent / "deixis",
        "up",
        "--robot",
        ROBOT,
        "--site",
        given.site.resolve(),
        "--listen",
        endpoint,
    ]
    settings = [f"camera.source={json.dumps(str(given.source.resolve()))}", "camera.loop=true"]
    settings += [f"camera.rate_hz={given.rate}"] if given.rate else []
    argv += [word for setting in settings for word in ("--set", setting)]
    argv += ["--registry", folder / "pois.sqlite", *(["--lockstep"] if given.lockstep else [])]
    with log.open("wb") as file:
        up = subprocess.Popen([*map(str, argv)], stderr=file, env=os.environ | {"DEIXIS_LOG": "INFO"})
    try:
        until_s = time.monotonic() + START_S
        while not (folder / "bench.sock").exists() and up.poll() is None and time.monotonic() < until_s:
            time.sleep(TURN_S)
        with open_client(endpoint, shared_memory=False) as session:
            while not _answers(session) and up.poll() is None and time.monotonic() < until_s:
                time.sleep(TURN_S)
            if up.poll() is not None or not _answers(session):
                raise RuntimeError(f"it does not start:\n{log.read_text()[-2000:]}")
            yield session, endpoint, log
    finally:
        up.terminate()
        with suppress(subprocess.TimeoutExpired):
            up.wait(20)
        up.kill()


def _answers(session: zenoh.Session) -> bool:
    state = get_state(session, ROBOT)
    return state is not None and state.last_seq >= FIRST_FRAMES


def swap(session: zenoh.Session, endpoint: str, name: str) -> Swapped:
    """Replace a stage once; a guest gives the place back to the supervisor's own. Raises Refusal, CommandError."""
    began_s = time.monotonic()
    stage = topics.HEAD_POSES.stage if name == GUEST else name
    procedure = SwapProcedure(session, ROBOT, stage)
    old = procedure.incumbent()
    newcomer: Newcomer
    if name == GUEST:
        script = EXAMPLES / "swap_headpose.py"
        newcomer = OwnNewcomer(f"{sys.executable} {script} --robot {{robot}} --connect {{connect}}", ROBOT, endpoint)
    else:
        newcomer = SupervisedNewcomer(session, ROBOT, stage, (), old)
    try:
        new = procedure.await_standing_by(newcomer)
        procedure.examine(old, new, newcomer)
        newcomer.keep(procedure.heard_now)
        cost = procedure.hand_over(old, new, newcomer, WATCH_S)
        took_s = time.monotonic() - began_s
    finally:
        newcomer.end()
    until_s = time.monotonic() + START_S
    while not procedure.heard_now() - ({new} if newcomer.ours else set()) and time.monotonic() < until_s:
        time.sleep(TURN_S)
    return Swapped(cost, took_s)


def measure(given: argparse.Namespace) -> dict[str, float]:
    """All figures. Raises RuntimeError, Unreachable, Refusal or CommandError where a run or a swap does not come about."""
    swapped: dict[str, list[Swapped]] = {name: [] for name in given.stages}
    with tempfile.TemporaryDirectory(prefix="swap-") as name, running(given, Path(name)) as (session, endpoint, log):
        for _ in range(given.rounds):
            for stage, results in swapped.items():
                results.append(swap(session, endpoint, stage))
        said = log.read_text(errors="replace")
    figures: dict[str, float] = {"rounds": given.rounds, "two_voices": said.count("more than one producer")}
    for stage, results in swapped.items():
        figures |= {f"{stage}_{name}": value for name, value in figures_of(results).items()}
    return figures


def figures_of(results: list[Swapped]) -> dict[str, float]:
    """Of the swaps of one stage."""
    costs = [result.cost for result in results]
    frames = sum(cost.answered + cost.unanswered for cost in costs)
    return {
        "gap_frames_p50": median(cost.gap_frames for cost in costs),
        "gap_frames_max": max(cost.gap_frames for cost in costs),
        "gap_ms_p50": round(median(cost.gap_s for cost in costs) * 1e3, 1),
        "gap_ms_max": round(max(cost.gap_s for cost in costs) * 1e3, 1),
        "usual_ms_p50": round(median(cost.usual_s for cost in costs) * 1e3, 1),
        "twice": sum(cost.twice for cost in costs),
        "unanswered_per_1000": round(1000 * sum(cost.unanswered for cost in costs) / max(1, frames), 1),
        "takes_s_p50": round(median(result.took_s for result in results), 2),
    }


def figure_table(figures: dict[str, float], stages: list[str]) -> Table:
    """One stage a row."""
    table = Table("stage", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for column in ("gap, frames", "gap, ms", "usually, ms", "twice", "unanswered of 1000", "takes, s"):
        table.add_column(column, justify="right")
    for name in stages:
        of = {key.removeprefix(f"{name}_"): value for key, value in figures.items() if key.startswith(f"{name}_")}
        table.add_row(
            name,
            f"{of['gap_frames_p50']:g} (max {of['gap_frames_max']:g})",
            f"{of['gap_ms_p50']:.0f} (max {of['gap_ms_max']:.0f})",
            *(f"{of[key]:g}" for key in ("usual_ms_p50", "twice", "unanswered_per_1000", "takes_s_p50")),
        )
    return table


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = [*topics.SWAPPABLE, GUEST]
    parser.add_argument("--rounds", type=int, default=10, metavar="N", help="each stage so often (default: 10)")
    parser.add_argument("--stages", default=",".join(known), metavar="NAMES", help="default: %(default)s")
    parser.add_argument("--lockstep", action="store_true", help="feed a frame when the last is answered: none is left out")
    parser.add_argument("--rate", type=float, metavar="HZ", help="frames a second (default: the video's)")
    parser.add_argument("--source", type=Path, default=EXAMPLES / "pointing.mp4", metavar="FILE", help="video to play")
    parser.add_argument("--site", type=Path, default=EXAMPLES / "pointing.yaml", metavar="FILE", help="its site file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    given.stages = given.stages.split(",")
    if unknown := set(given.stages) - set(known):
        parser.error(f"--stages: {', '.join(sorted(unknown))}: known are {', '.join(known)}")
    try:
        figures = measure(given)
    except (RuntimeError, Unreachable, Refusal, CommandError) as error:
        print(f"bench/swap: {error}", file=sys.stderr)
        return 1
    machine, console = describe_machine(), Console()
    console.print(figure_table(figures, given.stages))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    bad = {name: value for name, value in figures.items() if (name.endswith("_twice") or name == "two_voices") and value}
    for name, value in bad.items():
        print(f"bench/swap: {name}: {value:g}", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
