"""Whether the whole chain can run for days: memory, descriptors, threads and files while it plays the example again and again.

usage: python bench/soak.py [--minutes N] [--every SECONDS] [--source FILE] [--site FILE] [--json FILE]

Router, five stages and their supervisor (this process), each a process of its own, at the clip's own rate. At each sample
fusion's state is asked for, too. Samples are put together to medians of a minute (of a short run: a 20th of it); over these,
without the warm-up, the slope of each quantity is Theil and Sen's with its 95 % interval. It is
* flat, where the interval ends below what may grow by the hour (LIMITS: MB, descriptors, threads, files);
* grows, where the interval begins above that;
* undecided, where neither is so: run for longer.
Figures of each process, e.g. fusion: pss_mb_fusion (its share of shared pages), rss_mb_fusion, descriptors_fusion and
threads_fusion at the end, and those by the hour with _per_hour, _low, _high; system_shm_mb and system_shm_files: what the
processes have mapped of /dev/shm; system_tmp_mb and system_tmp_files: their temporary files; left_behind: files of /dev/shm and
temporary ones that are still there when all have stopped.
The exit is 1 where anything is not flat, a stage ended or stood still, or something was left behind. Ctrl-C ends the run early:
what was measured until then is judged.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import zenoh
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_runtime.host import SOURCE, Host, HostFailed, HostOptions
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import Unreachable
from deixis_schemas import topics
from flatness import Slope, Verdict, binned, theil_sen
from process_use import ProcessEnded, files_below, shared_files_of, size_mb, use_of
from rich import box
from rich.console import Console
from rich.table import Table

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
ROBOT = "soak"
SUPERVISOR = "supervisor"
SYSTEM = "system"
# What may grow in an hour and still counts as flat.
LIMITS = {"pss_mb": 4.0, "descriptors": 2.0, "threads": 2.0, "shm_mb": 4.0, "shm_files": 2.0, "tmp_mb": 4.0, "tmp_files": 2.0}
WARM_UP_SHARE = 0.2
WARM_UP_MOST_S = 300.0
BIN_S = 60.0
BINS_AT_LEAST = 20
TURN_S = 0.1
FIRST_BELIEF_S = 60.0
ANSWER_S = 5.0

Quantity = tuple[str, str]
"""Whose, and of what: `("fusion", "pss_mb")`."""


@dataclass
class Samples:
    """Monotonic times of the samples, and the values of each quantity."""

    times_s: list[float] = field(default_factory=list)
    values: dict[Quantity, list[float]] = field(default_factory=dict)
    shared_files: set[str] = field(default_factory=set)
    beliefs: int = 0
    failure: str = ""

    def add(self, at_s: float, values: dict[Quantity, float]) -> None:
        """Take in one sample."""
        self.times_s.append(at_s)
        for quantity, value in values.items():
            self.values.setdefault(quantity, []).append(value)


@dataclass(frozen=True)
class Finding:
    """How a quantity went."""

    first: float
    last: float
    slope: Slope | None
    verdict: Verdict


class Counter:
    """Counts what comes; Zenoh's threads call `store`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._count = 0

    def store(self, _sample: zenoh.Sample) -> None:
        """Callback of the subscriber."""
        with self._lock:
            self._count += 1

    def count(self) -> int:
        """What has come so far."""
        with self._lock:
            return self._count


def soak(source: Path, site: Path, seconds: float, every_s: float, folder: Path, interrupts: Interrupts) -> Samples:
    """Run the chain and sample it; a fault on the way ends that and is told.

    Raises HostFailed or Unreachable where it does not start.
    """
    sets: dict[str, tuple[str, ...]] = {
        SOURCE: (f"source={json.dumps(str(source))}", "loop=true", "encoding=bgr8"),
        "fusion": (f"registry={json.dumps(str(folder / 'pois.sqlite'))}",),
    }
    beliefs, samples = Counter(), Samples()
    with Host(HostOptions(robot=ROBOT, stages=topics.STAGES, site=site, listen=(), sets=sets)) as host:
        subscribers = []

        def listen() -> None:
            subscribers.append(host.session.declare_subscriber(topics.BELIEF.key(ROBOT), beliefs.store))

        host.start(listen, interrupts.requested)
        _watch(host, FIRST_BELIEF_S, lambda: bool(beliefs.count()) or interrupts.requested())
        until_s = time.monotonic() + seconds
        try:
            while time.monotonic() < until_s and not interrupts.requested():
                _step(host, every_s, folder, samples, beliefs, interrupts)
        except HostFailed as error:
            samples.failure = str(error)
        samples.beliefs = beliefs.count()
        subscribers.clear()
    return samples


def _step(host: Host, every_s: float, folder: Path, samples: Samples, beliefs: Counter, interrupts: Interrupts) -> None:
    """Let the chain run for that long and take a sample. Raises HostFailed."""
    before = beliefs.count()
    _watch(host, every_s, interrupts.requested)
    if interrupts.requested():
        return
    if beliefs.count() == before:
        raise HostFailed(f"no belief within {every_s:g} s: the chain stands still")
    _ask_state(host.session)
    samples.add(time.monotonic(), _sample(host, folder, samples.shared_files))


def _watch(host: Host, seconds: float, done: Callable[[], bool]) -> None:
    """Let the chain run until then, or until it is done. Raises HostFailed where a stage ends."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s and not done():
        host.poll()
        ended = [name for name, process in host.supervisor.processes.items() if process.last_end or process.given_up]
        if ended:
            raise HostFailed(f"ended while it was watched: {', '.join(ended)}")
        time.sleep(TURN_S)


def _ask_state(session: zenoh.Session) -> None:
    replies = list(session.get(topics.STATE.key(ROBOT), timeout=ANSWER_S))
    if not any(reply.ok is not None for reply in replies):
        raise HostFailed(f"{topics.STATE.key(ROBOT)} is not answered within {ANSWER_S:g} s")


def _sample(host: Host, folder: Path, ever_shared: set[str]) -> dict[Quantity, float]:
    pids = {name: process.popen.pid for name, process in host.supervisor.processes.items() if process.popen}
    values: dict[Quantity, float] = {}
    shared: set[str] = set()
    try:
        for name, pid in (pids | {SUPERVISOR: os.getpid()}).items():
            use = use_of(pid)
            values |= {(name, "pss_mb"): use.pss_mb, (name, "rss_mb"): use.rss_mb}
            values |= {(name, "descriptors"): use.descriptors, (name, "threads"): use.threads}
            shared |= shared_files_of(pid)
    except ProcessEnded as error:
        raise HostFailed(str(error)) from None
    ever_shared |= shared
    temporary = files_below(folder)
    values |= {(SYSTEM, "shm_mb"): size_mb(map(Path, shared)), (SYSTEM, "shm_files"): len(shared)}
    return values | {(SYSTEM, "tmp_mb"): size_mb(temporary), (SYSTEM, "tmp_files"): len(temporary)}


def findings_of(samples: Samples) -> dict[Quantity, Finding]:
    """Each quantity's slope and verdict, the warm-up left out; what has no limit (rss_mb) is never judged."""
    times_s = samples.times_s
    length_s = times_s[-1] - times_s[0] if times_s else 0.0
    begin_s = times_s[0] + min(WARM_UP_MOST_S, WARM_UP_SHARE * length_s) if times_s else 0.0
    skipped = sum(at_s < begin_s for at_s in times_s)
    bin_s = max(TURN_S, min(BIN_S, length_s / BINS_AT_LEAST))
    return {
        quantity: _finding(quantity, times_s[skipped:], values[skipped:], bin_s) for quantity, values in samples.values.items()
    }


def _finding(quantity: Quantity, times_s: list[float], values: list[float], bin_s: float) -> Finding:
    slope = theil_sen(*binned(times_s, values, bin_s))
    verdict: Verdict = slope.verdict(LIMITS.get(quantity[1], float("inf"))) if slope else "undecided"
    return Finding(values[0], values[-1], slope, verdict)


def left_behind(folder: Path, shared_files: set[str]) -> list[str]:
    """What is still there of the processes' temporary files and shared memory; the registry is no temporary file."""
    temporary = [str(file) for file in files_below(folder) if not file.name.startswith("pois.sqlite")]
    return temporary + sorted(name for name in shared_files if Path(name).exists())


def figures_of(findings: dict[Quantity, Finding]) -> dict[str, float]:
    """The findings as a flat map."""
    figures: dict[str, float] = {}
    for (whose, what), finding in findings.items():
        name = f"{whose}_{what}" if whose == SYSTEM else f"{what}_{whose}"
        figures[name] = finding.last
        if finding.slope is not None:
            slope = finding.slope
            figures |= {f"{name}_per_hour": slope.per_hour, f"{name}_low": slope.low, f"{name}_high": slope.high}
    return figures


def finding_table(findings: dict[Quantity, Finding]) -> Table:
    """One quantity a row."""
    table = Table("process", "quantity", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for title in ("warm", "end", "an hour", "95 % interval"):
        table.add_column(title, justify="right")
    table.add_column("")
    for (whose, what), finding in findings.items():
        slope = finding.slope
        grown = (f"{slope.per_hour:+.2f}", f"{slope.low:+.2f} to {slope.high:+.2f}") if slope else ("", "")
        table.add_row(whose, what, f"{finding.first:.1f}", f"{finding.last:.1f}", *grown, finding.verdict)
    return table


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0, metavar="N", help="length of the run (default: 30)")
    parser.add_argument("--every", type=float, default=5.0, metavar="SECONDS", help="time between samples (default: 5)")
    parser.add_argument("--source", type=Path, default=EXAMPLES / "pointing.mp4", metavar="FILE", help="video to play")
    parser.add_argument("--site", type=Path, default=EXAMPLES / "pointing.yaml", metavar="FILE", help="its site file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    with tempfile.TemporaryDirectory(prefix="soak-") as name:
        os.environ["TMPDIR"] = tempfile.tempdir = name  # of the stages and of us: what is in it is theirs
        try:
            return run(given, Path(name))
        except (HostFailed, Unreachable) as error:
            print(f"bench/soak: {error}", file=sys.stderr)
            return 1
        finally:
            tempfile.tempdir = None


def run(given: argparse.Namespace, folder: Path) -> int:
    """Soak, judge and tell; the exit status. Raises HostFailed, Unreachable."""
    with Interrupts() as interrupts:
        samples = soak(given.source.resolve(), given.site.resolve(), 60 * given.minutes, given.every, folder, interrupts)
    if not samples.times_s:
        raise HostFailed(samples.failure or "stopped before the first sample")
    findings, left = findings_of(samples), left_behind(folder, samples.shared_files)
    minutes = (samples.times_s[-1] - samples.times_s[0]) / 60
    figures = figures_of(findings) | {"minutes": minutes, "beliefs": samples.beliefs, "left_behind": len(left)}
    machine, console = describe_machine(), Console()
    console.print(finding_table(findings))
    asked = f" of {given.minutes:g} asked for" if interrupts.requested() or samples.failure else ""
    console.print(f"{minutes:.1f} minutes{asked}, {len(samples.times_s)} samples, {samples.beliefs} beliefs", highlight=False)
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    if samples.failure:
        print(f"bench/soak: ended early: {samples.failure}", file=sys.stderr)
    for file in left:
        print(f"bench/soak: left behind: {file}", file=sys.stderr)
    not_flat = [
        f"{whose}'s {what} ({finding.verdict})" for (whose, what), finding in findings.items() if finding.verdict != "flat"
    ]
    if not_flat:
        print(f"bench/soak: not flat: {', '.join(not_flat)}", file=sys.stderr)
    return 1 if not_flat or left or samples.failure else 0


if __name__ == "__main__":
    sys.exit(main())
