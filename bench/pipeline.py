"""The whole pipeline at VGA and 30 frames a second: processor time, memory, latency, dropped frames, start.

usage: python bench/pipeline.py [--seconds N] [--source FILE] [--site FILE] [--json FILE]

Plays examples/pointing.mp4 again and again at its own rate, raw frames, through router and stages, each a process of its
own. Only beliefs are listened to, for whoever listens to frames adds to the load. After a warm-up, over N seconds:
* cpu_ms_per_frame, and cpu_ms_per_frame_STAGE: user and system time of the processes (from /proc) by frames answered
  (by those played it would fall when frames are dropped);
* rss_mb, rss_mb_STAGE: resident memory at the end (shared pages count in each process that has them);
* latency_ms_p50, _p95, _p99: from the capture stamp of a frame to the receipt of fusion's belief about it;
* frames_dropped: frames of the source without a belief; frames_incomplete: beliefs that had to do without a stage;
* startup_s: from the start of the first process to the first belief.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import zenoh
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_runtime.host import SOURCE, Host, HostFailed, HostOptions
from deixis_runtime.session import Unreachable
from deixis_schemas import codec, topics
from deixis_schemas.messages import Belief
from rich.console import Console
from rich.table import Table

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
ROBOT = "bench"
WARM_UP_S = 5.0
FIRST_BELIEF_S = 60.0
TURN_S = 0.1


@dataclass(frozen=True)
class Usage:
    """Processor seconds and resident MB of a process."""

    cpu_s: float
    rss_mb: float


class Beliefs:
    """Beliefs as they come: receipt (Unix ns) with seq, stamp and whether a stage was missing."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._received: list[tuple[int, zenoh.Sample]] = []

    def store(self, sample: zenoh.Sample) -> None:
        """Zenoh callback: keep it, decode later."""
        received_ns = time.time_ns()
        with self._lock:
            self._received.append((received_ns, sample))

    def take(self) -> list[tuple[int, Belief]]:
        """What came since the last call. Raises codec.CodecError."""
        with self._lock:
            taken, self._received = self._received, []
        return [
            (at, codec.decode(Belief, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topics.BELIEF.max_bytes))
            for at, sample in taken
        ]


def measure(source: Path, site: Path, seconds: float) -> dict[str, float]:
    """Run the pipeline and give the figures. Raises HostFailed or Unreachable."""
    length = clip_length(source)
    sets: dict[str, tuple[str, ...]] = {SOURCE: (f"source={json.dumps(str(source))}", "loop=true", "encoding=bgr8")}
    beliefs = Beliefs()
    with Host(HostOptions(robot=ROBOT, stages=topics.STAGES, site=site, listen=(), sets=sets)) as host:
        began_s = time.monotonic()
        subscribers = []
        host.start(lambda: subscribers.append(host.session.declare_subscriber(topics.BELIEF.key(ROBOT), beliefs.store)))
        startup_s = await_first(host, beliefs) - began_s
        watch(host, WARM_UP_S)
        pids = {name: process.popen.pid for name, process in host.supervisor.processes.items() if process.popen}
        beliefs.take()
        before = {name: usage(pid) for name, pid in pids.items()}
        watch(host, seconds)
        after = {name: usage(pid) for name, pid in pids.items()}
        heard = beliefs.take()
        restarted = [name for name, process in host.supervisor.processes.items() if process.started > 1]
        subscribers.clear()
    if restarted:
        raise HostFailed(f"restarted while measured: {', '.join(restarted)}")
    if len(heard) < 2:
        raise HostFailed(f"{len(heard)} beliefs in {seconds:g} s")
    played = frames_played(heard, length)
    return {"startup_s": startup_s, **of_beliefs(heard, played), **of_processes(before, after, len(heard))}


def await_first(host: Host, beliefs: Beliefs) -> float:
    """Monotonic time of the first belief. Raises HostFailed."""
    deadline_s = time.monotonic() + FIRST_BELIEF_S
    while time.monotonic() < deadline_s:
        if beliefs.take():
            return time.monotonic()
        host.poll()
        time.sleep(0.01)
    raise HostFailed(f"no belief within {FIRST_BELIEF_S:g} s")


def watch(host: Host, seconds: float) -> None:
    """Let the pipeline run. Raises HostFailed."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        host.poll()
        if host.given_up:
            raise HostFailed(f"given up while measured: {', '.join(host.given_up)}")
        time.sleep(TURN_S)


def usage(pid: int) -> Usage:
    """What a process has used so far and holds now, from /proc."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines())
    cpu_s = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return Usage(cpu_s, int(status["VmRSS"].split()[0]) / 1024)


def clip_length(source: Path) -> int:
    """Frames of the clip. Raises HostFailed."""
    video = cv2.VideoCapture(str(source))
    length = int(video.get(cv2.CAP_PROP_FRAME_COUNT))
    video.release()
    if length <= 0:
        raise HostFailed(f"'{source}' is not a video")
    return length


def frames_played(heard: list[tuple[int, Belief]], length: int) -> int:
    """Frames of the source from the first belief to the last, by their numbers, which start anew with each loop."""
    seqs = [belief.seq for belief in sorted((belief for _, belief in heard), key=lambda belief: belief.stamp_ns)]
    return 1 + sum((later - sooner) % length for sooner, later in pairwise(seqs))


def of_beliefs(heard: list[tuple[int, Belief]], played: int) -> dict[str, float]:
    """Latencies and drops."""
    latencies_ms = [(at - belief.stamp_ns) / 1e6 for at, belief in heard]
    percentiles = {f"latency_ms_p{q}": float(np.percentile(latencies_ms, q)) for q in (50, 95, 99)}
    return {
        **percentiles,
        "frames": played,
        "frames_dropped": played - len({belief.frame_id for _, belief in heard}),
        "frames_incomplete": sum(bool(belief.missing) for _, belief in heard),
    }


def of_processes(before: dict[str, Usage], after: dict[str, Usage], frames: int) -> dict[str, float]:
    """Processor time by frame and memory, of all and of each."""
    cpu_ms = {name: 1000 * (after[name].cpu_s - before[name].cpu_s) / frames for name in after}
    return {
        "cpu_ms_per_frame": sum(cpu_ms.values()),
        **{f"cpu_ms_per_frame_{name}": value for name, value in cpu_ms.items()},
        "rss_mb": sum(used.rss_mb for used in after.values()),
        **{f"rss_mb_{name}": used.rss_mb for name, used in after.items()},
    }


def figure_table(figures: dict[str, float]) -> Table:
    """The figures, one a row."""
    table = Table("figure")
    table.add_column("value", justify="right")
    for name, value in figures.items():
        table.add_row(name, f"{value:.0f}" if name.startswith("frames") else f"{value:.1f}")
    return table


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, metavar="N", help="length of the measurement (default: 20)")
    parser.add_argument("--source", type=Path, default=EXAMPLES / "pointing.mp4", metavar="FILE", help="video to play")
    parser.add_argument("--site", type=Path, default=EXAMPLES / "pointing.yaml", metavar="FILE", help="its site file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    try:
        figures = measure(given.source.resolve(), given.site.resolve(), given.seconds)
    except (HostFailed, Unreachable, codec.CodecError) as error:
        print(f"bench/pipeline: {error}", file=sys.stderr)
        return 1
    machine = describe_machine()
    console = Console()
    console.print(figure_table(figures))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if figures["frames_dropped"] > 0.1 * figures["frames"]:
        console.print("Many frames were dropped: was the machine busy with something else?", style="yellow")
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
