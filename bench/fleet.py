"""What a fleet costs one edge: processor, memory and latency by the number of robots, and whether they ever hear each other.

usage: python bench/fleet.py [--robots 1,2,4,8,16] [--seconds N] [--json FILE]

On the edge run one router and, for each robot, gesture and fusion: real services, each a process of its own, with a site and a
registry of its own. A robot is a thread of this process with a connection of its own to the router over TCP: it plays the
recorded tracks and head poses of a shipped clip at 30 frames a second, again and again, stamped anew. So what is not in the
figures is the work on pictures, which `bench/pipeline.py` gives (tracker, headpose), and the robots' own part. Figures, each
with _N for N robots, over the measured seconds:
* cpu_cores: processor time of the edge's processes by time, 2.0 is two cores full; cpu_ms_per_frame, cpu_cores_router;
* pss_mb: their memory, shared pages counted once; pss_mb_per_robot: without the router's;
* latency_ms_p50, _p95: from the stamp of a frame, as its tracks go out, to the receipt of fusion's belief;
* answered: beliefs by frames played, complete: beliefs that had to do without no stage, by beliefs; late_ms: the latest that a
  robot was to play a frame: where it is large, this machine was full;
* targets: answers to pointings, right: those that name what that robot's recording points at, under the robot's own name of it,
  unsure: those that name nothing, or that one with others, as is due where too few frames come through; wrong: all others;
* foreign: beliefs and targets on a robot's keys that are not its own: of another's run, or with a POI of another. After each
  measurement each robot's registry is edited, and then all have to hold their own POIs and that one.
The exit is 1 where any robot heard another, was not answered at all, or was answered wrongly more than once in ten.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml
import zenoh
from deixis_evaluation.clips import ClipError
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_evaluation.references import ReferencesError
from deixis_runtime.host import ROUTER
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.liveliness import AliveStages
from deixis_runtime.session import Unreachable, open_client
from deixis_runtime.supervisor import Supervisor
from deixis_schemas import codec, topics
from deixis_schemas.messages import Belief, State, Target
from fleet_player import Player
from fleet_recording import Robot, fleet
from process_use import ProcessEnded, cpu_s_of, use_of
from rich import box
from rich.console import Console
from rich.table import Table

SERVICES = ("gesture", "fusion")
WARM_UP_S = 3.0
START_S = 120.0
ANSWER_S = 10.0
POLL_S = 0.1
WRONG_AT_MOST = 0.1
EDITED = "edited"
WIDTH = 100


class FleetFailed(RuntimeError):
    """A number of robots that could not be measured; the text says why."""


@dataclass
class Heard:
    """What came on the keys of all robots: receipt (Unix ns), key and payload. Zenoh's threads call `store`."""

    samples: list[tuple[int, zenoh.Sample]] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def store(self, sample: zenoh.Sample) -> None:
        """Callback of the subscriber: keep it, decode later."""
        received_ns = time.time_ns()
        with self.lock:
            self.samples.append((received_ns, sample))

    def take(self) -> list[tuple[int, zenoh.Sample]]:
        """What came since the last call."""
        with self.lock:
            taken, self.samples = self.samples, []
        return taken


@dataclass
class Said:
    """What the fusions said of their robots' frames in the measured time."""

    beliefs: list[tuple[int, str, Belief]] = field(default_factory=list)
    finals: list[tuple[str, Target]] = field(default_factory=list)
    foreign: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Edge:
    """The edge's processes, running: their numbers by name, and a session of ours."""

    pids: dict[str, int]
    session: zenoh.Session
    endpoint: str


@contextmanager
def edge(robots: Sequence[Robot], folder: Path, interrupts: Interrupts) -> Iterator[Edge]:
    """Router and services of these robots; all stopped at the end. Raises FleetFailed."""
    supervisor = Supervisor()
    with socket.create_server(("127.0.0.1", 0)) as free:
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    inside = f"unixsock-stream/{folder}/router.sock"
    router = [sys.executable, "-m", "deixis_runtime.router", "--supervised", "--listen", inside, "--listen", endpoint]
    with ExitStack() as stack:
        stack.callback(supervisor.stop)
        supervisor.start(ROUTER, router)
        session = stack.enter_context(_session(inside, supervisor, interrupts))
        for robot in robots:
            for service in SERVICES:
                supervisor.start(f"{service} {robot.name}", _command(service, robot, folder, inside))
        alive = {robot.name: AliveStages(session, robot.name) for robot in robots}
        _until(lambda: all(set(SERVICES) <= seen.stages() for seen in alive.values()), START_S, supervisor, interrupts)
        alive.clear()
        yield Edge(
            {name: process.popen.pid for name, process in supervisor.processes.items() if process.popen}, session, endpoint
        )


@contextmanager
def _session(endpoint: str, supervisor: Supervisor, interrupts: Interrupts) -> Iterator[zenoh.Session]:
    path = Path(endpoint.removeprefix("unixsock-stream/"))
    _until(path.exists, START_S, supervisor, interrupts)
    with open_client(endpoint, shared_memory=False) as session:
        yield session


def _command(service: str, robot: Robot, folder: Path, endpoint: str) -> list[str]:
    site = folder / f"{robot.name}.yaml"
    site.write_text(yaml.safe_dump(robot.site()), encoding="utf-8")
    command = [str(Path(sys.executable).parent / f"deixis-{service}"), "--supervised", "--robot", robot.name]
    command += ["--connect", endpoint, "--site", str(site)]
    return [*command, "--set", f"registry={folder / robot.name}.sqlite"] if service == "fusion" else command


def _until(ready: Callable[[], bool], seconds: float, supervisor: Supervisor, interrupts: Interrupts) -> None:
    deadline_s = time.monotonic() + seconds
    while not ready():
        ended = [name for name, process in supervisor.processes.items() if not process.running]
        if ended:
            raise FleetFailed(f"ended while starting: {', '.join(ended)}; the message stands above")
        if time.monotonic() > deadline_s:
            raise FleetFailed(f"the edge's processes are not ready within {seconds:g} s")
        _pause(POLL_S, interrupts)


def _pause(seconds: float, interrupts: Interrupts) -> None:
    if interrupts.wait(seconds):
        raise FleetFailed("interrupted")


def measure(count: int, seconds: float, interrupts: Interrupts) -> dict[str, float]:
    """The figures of so many robots. Raises FleetFailed, Unreachable, ClipError, ReferencesError, ProcessEnded."""
    robots = fleet(count, time.time_ns() // 1_000_000)
    heard = Heard()
    with tempfile.TemporaryDirectory(prefix="fleet-") as name, ExitStack() as stack:
        running = stack.enter_context(edge(robots, Path(name), interrupts))
        subscribers = [
            running.session.declare_subscriber(topic.key("*"), heard.store) for topic in (topics.BELIEF, topics.TARGET)
        ]
        players = [stack.enter_context(Player(robot, running.endpoint)) for robot in robots]
        _pause(WARM_UP_S, interrupts)
        heard.take()
        before_s, frames = {who: cpu_s_of(pid) for who, pid in running.pids.items()}, sum(player.frames for player in players)
        began_s = time.monotonic()
        _pause(seconds, interrupts)
        took_s, frames = time.monotonic() - began_s, sum(player.frames for player in players) - frames
        cpu_s = {who: cpu_s_of(pid) - before_s[who] for who, pid in running.pids.items()}
        pss_mb = {who: use_of(pid).pss_mb for who, pid in running.pids.items()}
        said = understood(heard.take(), {robot.name: robot for robot in robots})
        said.foreign += crossed_edits(running.session, robots)
        subscribers.clear()
    failures = [player.failure for player in players if player.failure]
    if failures:
        raise FleetFailed("; ".join(failures))
    for what in [*said.foreign[:5], *wrong_answers(said, robots)[:5]]:
        print(f"bench/fleet: {what}", file=sys.stderr)
    late_ms = 1000 * max(player.late_s for player in players)
    return {
        "frames": frames,
        "late_ms": late_ms,
        **of_processes(cpu_s, pss_mb, took_s, frames, count),
        **of_answers(said, robots, frames),
    }


def understood(samples: Sequence[tuple[int, zenoh.Sample]], robots: dict[str, Robot]) -> Said:
    """What was heard, decoded, each held against the robot on whose key it came. Raises FleetFailed."""
    said = Said()
    for received_ns, sample in samples:
        key = str(sample.key_expr)
        name = key.split("/")[1]
        topic = topics.topic_of(key)
        if name not in robots or topic not in (topics.BELIEF, topics.TARGET):
            said.foreign.append(f"{key}: nobody's")
            continue
        try:
            message = codec.decode(topic.type, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topic.max_bytes)
        except codec.CodecError as error:
            raise FleetFailed(f"{key}: {error}") from None
        assert isinstance(message, Belief | Target)
        if what := robots[name].foreign(message):
            said.foreign.append(what)
        if isinstance(message, Belief):
            said.beliefs.append((received_ns, name, message))
        elif message.final:
            said.finals.append((name, message))
    return said


def crossed_edits(session: zenoh.Session, robots: Sequence[Robot]) -> list[str]:
    """Edit each robot's registry, then say which holds other POIs than its own and that one."""
    wrong = []
    for robot in robots:
        key = topics.POI.key(robot.name, id=robot.own(EDITED))
        replies = list(session.get(key, payload=b'{"position_m": [1, 2, 3]}', encoding=codec.JSON, timeout=ANSWER_S))
        if not any(reply.ok is not None for reply in replies):
            wrong.append(f"{key}: the edit was not acknowledged")
    for robot in robots:
        own = {robot.own(poi.poi_id) for poi in robot.recording.pois} | {robot.own(EDITED)}
        held = _pois_held(session, robot)
        if held != own:
            wrong.append(f"{robot.name} holds {', '.join(sorted(held ^ own))} too much or not")
    return wrong


def _pois_held(session: zenoh.Session, robot: Robot) -> set[str]:
    key = topics.STATE.key(robot.name)
    for reply in session.get(f"{key}?top=1024", timeout=ANSWER_S):
        if reply.ok is not None:
            state = codec.decode(State, reply.ok.payload.to_bytes(), str(reply.ok.encoding), max_bytes=topics.STATE.max_bytes)
            return {poi.poi_id for poi in state.pois}
    return set()


def of_processes(
    cpu_s: dict[str, float], pss_mb: dict[str, float], seconds: float, frames: int, robots: int
) -> dict[str, float]:
    """Processor and memory of the edge's processes."""
    total_s, services_mb = sum(cpu_s.values()), sum(pss_mb.values()) - pss_mb[ROUTER]
    return {
        "cpu_cores": total_s / seconds,
        "cpu_cores_router": cpu_s[ROUTER] / seconds,
        "cpu_ms_per_frame": 1000 * total_s / max(1, frames),
        "pss_mb": sum(pss_mb.values()),
        "pss_mb_per_robot": services_mb / robots,
    }


def of_answers(said: Said, robots: Sequence[Robot], frames: int) -> dict[str, float]:
    """Latency, completeness, and whose answers they were."""
    answers = {robot.name: robot.answer for robot in robots}
    latencies_ms = [(at - belief.stamp_ns) / 1e6 for at, _, belief in said.beliefs]
    answered = Counter(name for _, name, _ in said.beliefs)
    p50, p95 = np.percentile(latencies_ms, (50, 95)) if latencies_ms else (float("inf"), float("inf"))
    return {
        "latency_ms_p50": float(p50),
        "latency_ms_p95": float(p95),
        "answered": len(said.beliefs) / max(1, frames),
        "complete": sum(not belief.missing for _, _, belief in said.beliefs) / max(1, len(said.beliefs)),
        "robots_unanswered": sum(not answered[robot.name] for robot in robots),
        "targets": len(said.finals),
        "right": sum(target.poi_ids == answers[name] for name, target in said.finals),
        "unsure": sum(target.poi_ids != answers[name] and not is_wrong(target, answers[name]) for name, target in said.finals),
        "wrong": sum(is_wrong(target, answers[name]) for name, target in said.finals),
        "foreign": len(said.foreign),
    }


def wrong_answers(said: Said, robots: Sequence[Robot]) -> list[str]:
    """The answers that name something else than the recording points at, in words."""
    answers = {robot.name: robot.answer for robot in robots}
    return [
        f"{name}: {', '.join(target.poi_ids)} for {', '.join(answers[name])}: {target.reason}"
        for name, target in said.finals
        if is_wrong(target, answers[name])
    ]


def is_wrong(target: Target, answer: list[str]) -> bool:
    """Whether it names something without what was pointed at; nothing, or that among others, is unsure and not wrong."""
    return bool(target.poi_ids) and not set(answer) <= set(target.poi_ids)


def faults_of(count: int, figures: dict[str, float]) -> list[str]:
    """What must not be, in words."""
    targets, right, wrong = figures["targets"], figures["right"], figures["wrong"]
    found = {
        f"{figures['robots_unanswered']:.0f} of {count} robots were not answered": figures["robots_unanswered"] > 0,
        f"{figures['foreign']:.0f} answers or registries with another robot's": figures["foreign"] > 0,
        f"{wrong:.0f} of {targets:.0f} pointings of {count} robots answered wrongly": wrong > WRONG_AT_MOST * targets,
        f"none of {targets:.0f} pointings of {count} robots answered rightly": not right,
    }
    return [text for text, so in found.items() if so]


def figure_table(measured: dict[int, dict[str, float]]) -> Table:
    """One number of robots a row."""
    table = Table("robots", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    columns: dict[str, Callable[[dict[str, float]], str]] = {
        "cores": lambda f: f"{f['cpu_cores']:.2f}",
        "router": lambda f: f"{f['cpu_cores_router']:.2f}",
        "ms/frame": lambda f: f"{f['cpu_ms_per_frame']:.1f}",
        "MB": lambda f: f"{f['pss_mb']:.0f}",
        "MB/robot": lambda f: f"{f['pss_mb_per_robot']:.0f}",
        "p50 ms": lambda f: f"{f['latency_ms_p50']:.1f}",
        "p95 ms": lambda f: f"{f['latency_ms_p95']:.1f}",
        "answered": lambda f: f"{100 * f['answered']:.1f} %",
        "right": lambda f: f"{f['right']:.0f}/{f['targets']:.0f}",
        "wrong": lambda f: f"{f['wrong']:.0f}",
        "foreign": lambda f: f"{f['foreign']:.0f}",
    }
    for title in columns:
        table.add_column(title, justify="right")
    for count, figures in measured.items():
        table.add_row(str(count), *(text(figures) for text in columns.values()))
    return table


def numbers(text: str) -> list[int]:
    """Numbers of robots from the command line. Raises argparse.ArgumentTypeError."""
    try:
        given = [int(part) for part in text.split(",")]
    except ValueError:
        given = []
    if not given or not all(1 <= number <= 16 for number in given):
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of numbers from 1 to 16, as 1,2,4")
    return given


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--robots", type=numbers, default=[1, 2, 4, 8, 16], metavar="N,...", help="numbers (default: 1,2,4,8,16)"
    )
    parser.add_argument("--seconds", type=float, default=20.0, metavar="N", help="measured time of each number (default: 20)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    os.environ.setdefault("DEIXIS_LOG", "ERROR")
    measured: dict[int, dict[str, float]] = {}
    failure = ""
    with Interrupts() as interrupts:
        try:
            for count in given.robots:
                measured[count] = measure(count, given.seconds, interrupts)
        except (FleetFailed, Unreachable, ClipError, ReferencesError, ProcessEnded) as error:
            failure = str(error)
    machine, console = describe_machine(), Console()
    console.width = max(console.width, WIDTH)
    if measured:
        console.print(figure_table(measured))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        flat = {f"{name}_{count}": value for count, figures in measured.items() for name, value in figures.items()}
        given.json.write_text(json.dumps({"machine": machine, "figures": flat}, indent=1) + "\n", encoding="utf-8")
    faults = [fault for count, figures in measured.items() for fault in faults_of(count, figures)]
    for text in [*faults, failure]:
        if text:
            print(f"bench/fleet: {text}", file=sys.stderr)
    return 1 if faults or failure else 0


if __name__ == "__main__":
    sys.exit(main())
