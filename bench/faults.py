"""What a fault costs: each process killed and stopped, until that is noticed and until it works again; and what is left.

usage: python bench/faults.py [--rounds N] [--source FILE] [--site FILE] [--json FILE]

A round runs `deixis up` with router and five stages on the looped example twice. In the first run each process in turn gets a
SIGKILL, and SIGTERM ends the run; in the second each gets a SIGSTOP, then the supervisor for 5 seconds, and SIGKILL of the
supervisor ends it. p50 and max over the rounds, in seconds from the signal on, for FAULT killed and stopped:
* STAGE_FAULT_noticed_s: until the supervisor says so in its log;
* STAGE_FAULT_again_s: until the first heartbeat of the new process is heard over the router;
* router_FAULT_again_s: until a heartbeat of every stage has come through the new router;
* sigterm_gone_s, supervisor_killed_gone_s: until no process of ours is left.
Counted over all rounds: healthy_restarted: processes replaced without a fault of theirs (also by the supervisor that was
stopped); left_processes, left_shm_files (of /dev/shm, that ours had mapped) and left_tmp_files when a run is over; not_again:
faults after which there was no heartbeat within 20 seconds. The exit is 1 where one of those counts is not 0. Run it on an idle
machine: what else it does is in the figures, too.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from statistics import median
from typing import IO, TypeVar

import zenoh
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_runtime.session import Unreachable, open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health
from process_use import ProcessEnded, files_below, shared_files_of
from rich import box
from rich.console import Console
from rich.table import Table

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
ROBOT = "faults"
ROUTER = "router"
PROCESSES = (ROUTER, *topics.STAGES)
FAULTS = {"killed": signal.SIGKILL, "stopped": signal.SIGSTOP}
SUPERVISOR_STOPPED_S = 5.0
TURN_S = 0.005
START_S = 60.0
AGAIN_S = 20.0
GONE_S = 20.0
SETTLE_S = 2.0

T = TypeVar("T")
Times = dict[str, list[float]]


class Heard:
    """Heartbeats and the supervisor's log lines, each with the monotonic time at which it came."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._beats: list[tuple[float, str, int]] = []
        self._lines: list[tuple[float, str]] = []

    def store(self, sample: zenoh.Sample) -> None:
        """Callback of the subscriber to health."""
        at_s = time.monotonic()
        with suppress(codec.CodecError):  # then it is no heartbeat
            health = codec.decode(Health, sample.payload.to_bytes(), str(sample.encoding))
            with self._lock:
                self._beats.append((at_s, health.stage, health.pid))

    def read(self, log: IO[str]) -> None:
        """Read the log to its end; the body of a thread."""
        for line in log:
            with self._lock:
                self._lines.append((time.monotonic(), line))

    def beat(self, stage: str, since_s: float, other_than: int = 0) -> float | None:
        """When the stage was first heard after that time, from another process than this."""
        with self._lock:
            return next((at for at, who, pid in self._beats if who == stage and at > since_s and pid != other_than), None)

    def noticed(self, name: str, since_s: float) -> float | None:
        """When the supervisor first said something of the process after that time."""
        about = re.compile(rf"deixis-supervisor (WARNING|ERROR) {name} ")
        with self._lock:
            return next((at for at, line in self._lines if at > since_s and about.search(line)), None)

    def log(self) -> str:
        """The end of the log."""
        with self._lock:
            return "".join(line for _, line in self._lines[-20:])


class Run:
    """A running `deixis up`, its children as they are now, and what they ever had mapped of shared memory."""

    def __init__(self, up: subprocess.Popen[str], heard: Heard) -> None:
        self.up = up
        self.heard = heard
        self.mapped: set[str] = set()

    def children(self) -> dict[str, int]:
        """Process numbers by name."""
        found = {}
        with suppress(FileNotFoundError, ProcessLookupError):
            for child in Path(f"/proc/{self.up.pid}/task/{self.up.pid}/children").read_text().split():
                if name := name_of(int(child)):
                    found[name] = int(child)
        return found

    def note_mapped(self) -> None:
        """Remember what the children have mapped now."""
        for pid in self.children().values():
            with suppress(ProcessEnded):
                self.mapped |= shared_files_of(pid)

    def wait_until_all_beat(self, since_s: float) -> float | None:
        """When the last of the stages was first heard after that time; none where one is not heard in time."""
        times = [wait_for(lambda stage=stage: self.heard.beat(stage, since_s), AGAIN_S) for stage in topics.STAGES]  # type: ignore[misc]
        return None if None in times else max(filter(None, times))

    def when_well(self) -> dict[str, int]:
        """The children, as soon as all of them are there and the stages beat. Raises RuntimeError where that does not come."""
        beaten_s = self.wait_until_all_beat(time.monotonic())
        children = wait_for(lambda: found if len(found := self.children()) == len(PROCESSES) else None, AGAIN_S)
        if beaten_s is None or children is None:
            raise RuntimeError(f"it does not recover:\n{self.heard.log()}")
        return children


def name_of(pid: int) -> str | None:
    """Which of ours a process is; none for another, or one that has ended."""
    try:
        line = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except (FileNotFoundError, ProcessLookupError):
        return None
    if " deixis_runtime.router " in line:
        return ROUTER
    # Forked or not: `deixis-camera ...` or `/.../python /.../bin/deixis-camera ...`.
    return next((stage for stage in topics.STAGES if re.search(rf"(^|/)deixis-{stage} ", line)), None)


def wait_for(look: Callable[[], T | None], timeout_s: float) -> T | None:
    """What `look` finds, as soon as it finds something; none after the time."""
    deadline_s = time.monotonic() + timeout_s
    while (found := look()) is None and time.monotonic() < deadline_s:
        time.sleep(TURN_S)
    return found


@contextmanager
def running(source: Path, site: Path, folder: Path) -> Iterator[Run]:
    """`deixis up`, until all stages beat. Raises RuntimeError where it does not start."""
    endpoint = f"unixsock-stream/{folder}/bench.sock"
    argv = [Path(sys.executable).parent / "deixis", "up", "--robot", ROBOT, "--site", site, "--listen", endpoint]
    for setting in (f"camera.source={json.dumps(str(source))}", "camera.loop=true"):
        argv += ["--set", setting]
    argv += ["--registry", folder / "pois.sqlite"]
    environment = os.environ | {"TMPDIR": str(folder / "tmp"), "DEIXIS_LOG": "INFO"}
    heard = Heard()
    up = subprocess.Popen([*map(str, argv)], stderr=subprocess.PIPE, text=True, env=environment)
    run = Run(up, heard)
    assert up.stderr is not None
    reader = threading.Thread(target=heard.read, args=(up.stderr,), daemon=True)
    reader.start()
    try:
        wait_for(lambda: (folder / "bench.sock").exists() or up.poll() is not None or None, START_S)
        with open_client(endpoint, shared_memory=False) as session:
            subscriber = session.declare_subscriber(topics.HEALTH.key(ROBOT, stage="*"), heard.store)
            if run.wait_until_all_beat(0.0) is None:
                raise RuntimeError(f"not all stages beat:\n{heard.log()}")
            yield run
            subscriber.undeclare()  # type: ignore[no-untyped-call]
    finally:
        if up.poll() is None:
            up.kill()
        up.wait()


def hurt(run: Run, name: str, fault: str, times: Times, counts: Counter[str]) -> None:
    """Do this to one process, and note how long it takes until it works again."""
    before = run.when_well()
    run.note_mapped()
    since_s = time.monotonic()
    os.kill(before[name], FAULTS[fault])
    again_s = _again(run, name, before[name], since_s)
    noticed_s = run.heard.noticed(name, since_s)
    if again_s is None:
        counts["not_again"] += 1
        with suppress(ProcessLookupError):
            os.kill(before[name], signal.SIGKILL)  # so that the next fault finds a system that works
        return
    times.setdefault(f"{name}_{fault}_again_s", []).append(again_s - since_s)
    if noticed_s is not None:
        times.setdefault(f"{name}_{fault}_noticed_s", []).append(noticed_s - since_s)
    time.sleep(SETTLE_S)  # what was wrongly held against the others would show now
    counts["healthy_restarted"] += _replaced(before, run.children(), name)


def _again(run: Run, name: str, pid: int, since_s: float) -> float | None:
    if name != ROUTER:
        return wait_for(lambda: run.heard.beat(name, since_s, other_than=pid), AGAIN_S)
    new = wait_for(lambda: run.children().get(ROUTER, pid) != pid or None, AGAIN_S)
    return run.wait_until_all_beat(time.monotonic()) if new else None


def _replaced(before: dict[str, int], now: dict[str, int], but: str = "") -> int:
    return sum(now.get(name) != pid for name, pid in before.items() if name != but)


def stop_supervisor(run: Run, counts: Counter[str]) -> None:
    """Stop the supervisor for some seconds: it must not hold its own silence against others."""
    before = run.when_well()
    run.up.send_signal(signal.SIGSTOP)
    time.sleep(SUPERVISOR_STOPPED_S)
    run.up.send_signal(signal.SIGCONT)
    time.sleep(SETTLE_S)
    counts["healthy_restarted"] += _replaced(before, run.children())


def end(run: Run, number: signal.Signals, folder: Path, counts: Counter[str]) -> float:
    """End the supervisor by this signal; seconds until all are gone, and what they left is counted."""
    run.note_mapped()
    pids = set(run.children().values())
    since_s = time.monotonic()
    run.up.send_signal(number)
    wait_for(lambda: (run.up.poll() is not None and not any(map(_runs, pids))) or None, GONE_S)
    took_s = time.monotonic() - since_s
    left = [pid for pid in pids if _runs(pid)]
    counts["left_processes"] += len(left)
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    shared = [name for name in run.mapped if Path(name).exists()]
    counts["left_shm_files"] += len(shared)
    counts["left_tmp_files"] += len(files_below(folder / "tmp"))
    for name in shared:  # of processes that are gone: they would take 16 MB each until the next boot
        Path(name).unlink()
    return took_s


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def measure(source: Path, site: Path, rounds: int) -> dict[str, float]:
    """All figures. Raises RuntimeError or Unreachable where a run does not start."""
    times, counts = Times(), Counter[str]()
    for _ in range(rounds):
        for fault, last in (("killed", signal.SIGTERM), ("stopped", signal.SIGKILL)):
            with tempfile.TemporaryDirectory(prefix="faults-") as name:
                folder = Path(name)
                (folder / "tmp").mkdir()
                with running(source, site, folder) as run:
                    for victim in PROCESSES:
                        hurt(run, victim, fault, times, counts)
                    if last == signal.SIGKILL:
                        stop_supervisor(run, counts)
                    took_s = end(run, last, folder, counts)
                times.setdefault("sigterm_gone_s" if last == signal.SIGTERM else "supervisor_killed_gone_s", []).append(took_s)
    counted = ("not_again", "healthy_restarted", "left_processes", "left_shm_files", "left_tmp_files")
    figures: dict[str, float] = {"rounds": rounds, **{name: counts[name] for name in counted}}
    for name, values in times.items():
        figures |= {f"{name}_p50": round(median(values), 3), f"{name}_max": round(max(values), 3)}
    return figures


def figure_table(figures: dict[str, float]) -> Table:
    """One process a row."""
    table = Table("process", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for fault in FAULTS:
        table.add_column(f"{fault}: noticed", justify="right")
        table.add_column("again", justify="right")
    for name in PROCESSES:
        said = [_said(figures, f"{name}_{fault}_{what}_s") for fault in FAULTS for what in ("noticed", "again")]
        table.add_row(name, *said)
    return table


def _said(figures: dict[str, float], name: str) -> str:
    return f"{figures[f'{name}_p50']:.2f} (max {figures[f'{name}_max']:.2f})" if f"{name}_p50" in figures else "never"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="each fault so often (default: 3)")
    parser.add_argument("--source", type=Path, default=EXAMPLES / "pointing.mp4", metavar="FILE", help="video to play")
    parser.add_argument("--site", type=Path, default=EXAMPLES / "pointing.yaml", metavar="FILE", help="its site file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    try:
        figures = measure(given.source.resolve(), given.site.resolve(), given.rounds)
    except (RuntimeError, Unreachable) as error:
        print(f"bench/faults: {error}", file=sys.stderr)
        return 1
    machine, console = describe_machine(), Console()
    console.print(figure_table(figures))
    for name in ("sigterm_gone_s", "supervisor_killed_gone_s"):
        console.print(f"{name}: {_said(figures, name)}", highlight=False)
    bad = {name: figures[name] for name in figures if name.startswith(("not_", "healthy_", "left_")) and figures[name]}
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    for name, value in bad.items():
        print(f"bench/faults: {name}: {value:g}", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
