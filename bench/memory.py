"""Where memory goes, imports included, and where the processor's time of a frame goes: by process and part.

usage: python bench/memory.py [--seconds N] [--source FILE] [--site FILE] [--json FILE]

Three tables:
* what the imports of each process take where it is started from nothing: MB that it alone holds, step by step
  (import_mb_PROCESS_STEP) and all together (import_mb_PROCESS);
* what the running system holds while it plays the example, with `deixis up`: forked from a process that has done the imports,
  and with `--no-fork` (`_unforked` behind the name), where each is started from nothing, as by systemd and in containers.
  Pages that several processes have count with equal shares (PSS), so that the sum is what the system takes: pss_mb and
  pss_mb_PROCESS, of which objects, libraries, shared memory and stacks (pss_mb_PROCESS_PART); uss_mb_PROCESS: what nobody
  shares. rss_mb: shared pages counted each time;
* milliseconds of the processor for each frame answered by process and thread, forked: the loop, in which a stage does its work,
  Zenoh's threads, others (cpu_ms_PROCESS, cpu_ms_PROCESS_THREAD, cpu_ms of all).
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import zenoh
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_runtime.environment import ENVIRONMENT
from deixis_runtime.host import ROUTER, HostFailed
from deixis_runtime.session import Unreachable, open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health
from process_parts import LIBRARIES, OBJECTS, SHARED, THREADS, parts_of, thread_seconds
from process_use import ProcessEnded, parse_rollup
from rich import box
from rich.console import Console
from rich.table import Table

BIN = Path(sys.executable).parent
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
ROBOT = "memory"
SUPERVISOR, FORKSERVER = "supervisor", "forkserver"
PROCESSES = (ROUTER, *topics.STAGES, SUPERVISOR, FORKSERVER)
STARTS_WITHIN_S = 60.0
WARM_UP_S = 6.0
STOPS_WITHIN_S = 15.0
TURN_S = 0.2

COMMON_STEPS = ("zenoh=zenoh", "messages=deixis_schemas.messages,deixis_schemas.codec")
PICTURE_STEPS = ("numpy=numpy", "opencv=cv2")
IMPORTS: dict[str, tuple[str, ...]] = {
    ROUTER: (*COMMON_STEPS, "own=deixis_runtime.router"),
    **{
        stage: (*COMMON_STEPS, *PICTURE_STEPS, "runtime=deixis_runtime.stage", f"own=deixis_{stage}.service")
        for stage in topics.STAGES
    },
    SUPERVISOR: (*COMMON_STEPS, "own=deixis_cli.main,deixis_cli.up"),
}
"""What is imported step by step: `NAME=MODULE,MODULE`."""


def imports() -> dict[str, dict[str, float]]:
    """MB by process and step. Raises subprocess.CalledProcessError."""
    script = Path(__file__).with_name("import_steps.py")
    answers = {}
    for process, steps in IMPORTS.items():
        ran = subprocess.run(
            [sys.executable, script, *steps], env={**ENVIRONMENT, **os.environ}, stdout=subprocess.PIPE, check=True
        )
        answers[process] = {step: told["private_mb"] for step, told in json.loads(ran.stdout).items()}
    return answers


@contextmanager
def running(source: Path, site: Path, *options: str) -> Iterator[tuple[int, zenoh.Session]]:
    """`deixis up` that plays the source again and again: its process number, and a session of ours once it answers.

    Raises HostFailed or Unreachable.
    """
    with TemporaryDirectory(prefix="deixis-bench-") as folder:
        endpoint = f"unixsock-stream/{folder}/bench.sock"
        argv = [str(BIN / "deixis"), "up", "--robot", ROBOT, "--site", str(site), "--listen", endpoint, *options]
        argv += [
            "--set",
            f"camera.source={json.dumps(str(source))}",
            "--set",
            "camera.loop=true",
            "--set",
            "camera.encoding=bgr8",
        ]
        argv += ["--registry", f"{folder}/pois.sqlite"]
        with subprocess.Popen(argv, stdin=subprocess.DEVNULL) as child:
            try:
                _await(child, Path(f"{folder}/bench.sock"))
                with open_client(endpoint, shared_memory=False) as session:
                    yield child.pid, session
            finally:
                child.terminate()
                child.wait(STOPS_WITHIN_S)


def measure(source: Path, site: Path, seconds: float, *options: str) -> dict[str, float]:
    """The figures of one way to start. Raises HostFailed, ProcessEnded or Unreachable."""
    with running(source, site, *options) as (supervisor, session):
        _await_frames(session)
        time.sleep(WARM_UP_S)
        pids = processes_of(supervisor)
        spent, frames = {name: thread_seconds(pid) for name, pid in pids.items()}, _frames(session)
        time.sleep(seconds)
        frames = _frames(session) - frames
        if processes_of(supervisor) != pids or frames <= 0:
            raise HostFailed(f"a process has ended while measured, or no frame was answered ({frames})")
        spent = {
            name: {kind: seconds - spent[name][kind] for kind, seconds in thread_seconds(pid).items()}
            for name, pid in pids.items()
        }
        figures = memory_figures(pids)
    return figures | cpu_figures(spent, frames)


def processes_of(supervisor: int) -> dict[str, int]:
    """Process numbers of the supervisor and its children, by name."""
    found = {SUPERVISOR: supervisor}
    for thread in os.listdir(f"/proc/{supervisor}/task"):
        for child in Path(f"/proc/{supervisor}/task/{thread}/children").read_text(encoding="ascii").split():
            found[name_of(Path(f"/proc/{child}/cmdline").read_text(encoding="utf-8"))] = int(child)
    return found


def name_of(command_line: str) -> str:
    """Which of PROCESSES has this command line. Raises ValueError where none has."""
    words = {ROUTER: "deixis_runtime.router", FORKSERVER: "deixis_runtime.forkserver"}
    words |= {stage: f"deixis-{stage}" for stage in topics.STAGES}
    for name, word in words.items():
        if word in command_line:
            return name
    raise ValueError(f"'{command_line[:80]}' is none of ours")


def memory_figures(pids: dict[str, int]) -> dict[str, float]:
    """Memory of each process, and of all."""
    figures: dict[str, float] = {}
    for name, pid in pids.items():
        kb = parse_rollup(Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8"))
        figures[f"pss_mb_{name}"], figures[f"rss_mb_{name}"] = kb["Pss"] / 1024, kb["Rss"] / 1024
        figures[f"uss_mb_{name}"] = (kb["Private_Clean"] + kb["Private_Dirty"]) / 1024
        figures |= {f"pss_mb_{name}_{part}": mb for part, mb in parts_of(pid).items()}
    return figures | {kind: sum(figures[f"{kind}_{name}"] for name in pids) for kind in ("pss_mb", "uss_mb", "rss_mb")}


def cpu_figures(spent: dict[str, dict[str, float]], frames: int) -> dict[str, float]:
    """Milliseconds a frame of each process and kind of thread, and of all."""
    figures = {
        f"cpu_ms_{name}_{kind}": 1000 * seconds / frames for name, kinds in spent.items() for kind, seconds in kinds.items()
    }
    of_process = {f"cpu_ms_{name}": 1000 * sum(kinds.values()) / frames for name, kinds in spent.items()}
    return figures | of_process | {"cpu_ms": sum(of_process.values())}


def _await(child: subprocess.Popen[bytes], path: Path) -> None:
    deadline_s = time.monotonic() + STARTS_WITHIN_S
    while not path.exists():
        if child.poll() is not None or time.monotonic() > deadline_s:
            raise HostFailed("`deixis up` has not started")
        time.sleep(TURN_S)


def _await_frames(session: zenoh.Session) -> None:
    deadline_s = time.monotonic() + STARTS_WITHIN_S
    while not _frames(session):
        if time.monotonic() > deadline_s:
            raise HostFailed(f"no frame is answered within {STARTS_WITHIN_S:g} s")
        time.sleep(TURN_S)


def _frames(session: zenoh.Session) -> int:
    """Frames that fusion has answered; 0 while it does not say."""
    for reply in session.get(topics.HEALTH.key(ROBOT, stage=topics.BELIEF.stage), timeout=2.0):
        if reply.ok is not None:
            health = codec.decode(Health, reply.ok.payload.to_bytes(), str(reply.ok.encoding))
            return sum(item.published for item in health.outputs if item.key == topics.BELIEF.key(ROBOT))
    return 0


def import_table(told: dict[str, dict[str, float]]) -> Table:
    """What imports take, started from nothing."""
    steps = list(dict.fromkeys(step for of_process in told.values() for step in of_process))
    table = Table("imports, MB", *steps, "all", box=box.SIMPLE)
    for process, mb in told.items():
        cells = [f"{mb[step]:.1f}" if step in mb else "" for step in steps]
        table.add_row(process, *cells, f"{sum(mb.values()):.1f}")
    return table


def memory_table(figures: dict[str, float]) -> Table:
    """What the processes hold, forked and not."""
    table = Table("held, MB", "PSS", "objects", "libraries", "shared memory", "USS", "RSS", "PSS, not forked", box=box.SIMPLE)
    for name in PROCESSES:
        keys = [f"pss_mb_{name}", *(f"pss_mb_{name}_{part}" for part in (OBJECTS, LIBRARIES, SHARED))]
        keys += [f"uss_mb_{name}", f"rss_mb_{name}", f"pss_mb_{name}_unforked"]
        table.add_row(name, *(f"{figures[key]:.1f}" if key in figures else "" for key in keys))
    parts = [sum(figures[f"pss_mb_{name}_{part}"] for name in PROCESSES) for part in (OBJECTS, LIBRARIES, SHARED)]
    table.add_section()
    sums = [figures["pss_mb"], *parts, figures["uss_mb"], figures["rss_mb"], figures["pss_mb_unforked"]]
    table.add_row("all", *(f"{mb:.1f}" for mb in sums))
    return table


def cpu_table(figures: dict[str, float]) -> Table:
    """What a frame costs."""
    table = Table("processor, ms a frame", *THREADS, "all", box=box.SIMPLE)
    for name in PROCESSES:
        cells = [figures[f"cpu_ms_{name}_{kind}"] for kind in THREADS]
        table.add_row(name, *(f"{ms:.2f}" for ms in (*cells, figures[f"cpu_ms_{name}"])))
    table.add_section()
    table.add_row("all", *("" for _ in THREADS), f"{figures['cpu_ms']:.2f}")
    return table


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=12.0, metavar="N", help="length of each measurement (default: 12)")
    parser.add_argument("--source", type=Path, default=EXAMPLES / "pointing.mp4", metavar="FILE", help="video to play")
    parser.add_argument("--site", type=Path, default=EXAMPLES / "pointing.yaml", metavar="FILE", help="its site file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    played = given.source.resolve(), given.site.resolve(), given.seconds
    try:
        told = imports()
        figures = measure(*played)
        figures |= {f"{name}_unforked": value for name, value in measure(*played, "--no-fork").items()}
    except (HostFailed, ProcessEnded, Unreachable, OSError, subprocess.SubprocessError, codec.CodecError) as error:
        print(f"bench/memory: {error}", file=sys.stderr)
        return 1
    for process, mb in told.items():
        figures |= {f"import_mb_{process}_{step}": value for step, value in mb.items()}
        figures[f"import_mb_{process}"] = sum(mb.values())
    machine, console = describe_machine(), Console()
    for table in (import_table(told), memory_table(figures), cpu_table(figures)):
        console.print(table)
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
