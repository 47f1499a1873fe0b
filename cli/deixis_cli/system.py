"""A running system as seen from outside: who is alive, and what each stage says of itself."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import zenoh
from deixis_runtime.clock_offset import Exchange, Offset, estimate
from deixis_runtime.versions import versions_of
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, Health, State

from .gets import Refusal, TimedHealth, get_all, get_state, get_timed_healths

TOKENS_TIMEOUT_S = 2.0

Standing = Literal["ok", "degraded", "failed", "heard", "hung", "no token", "stands by"]
HEARD_ONLY = "its messages are heard, but it answers no get of its health"


@dataclass(frozen=True)
class StageProcess:
    """One process of a stage. alive: its liveliness token stands. cpu_percent: over the time looked at, none if unknown.

    clock: how far the clock of its host is ahead of ours.
    """

    stage: str
    instance: str
    alive: bool
    health: Health | None
    cpu_percent: float | None = None
    clock: Offset | None = None

    @property
    def name(self) -> str:
        """As messages name their producer: `stage/instance`."""
        return f"{self.stage}/{self.instance}"


@dataclass(frozen=True)
class System:
    """All that is known of one robot's system.

    supervisors: of its hosts, as they started the stages. refused: healths we cannot read; ours: versions that the asker runs.
    """

    robot: str
    processes: list[StageProcess] = field(default_factory=list)
    camera: CameraInfo | None = None
    state: State | None = None
    refused: list[Refusal] = field(default_factory=list)
    ours: Mapping[str, str] = field(default_factory=dict)
    supervisors: list[StageProcess] = field(default_factory=list)

    def heard(self) -> set[str]:
        """`stage/instance` of all whose messages the stages have heard lately."""
        return {producer for p in self.processes if p.health for i in p.health.inputs for producer in i.producers}

    def standing(self, process: StageProcess) -> Standing:
        """What the stage says, or that it says nothing (`hung`), or that it has no token (not one of the runtime's).

        One that stands by, before or after a hot swap, works and is not heard.

        A stage of one's own need not give health: while its messages come it is `heard`.
        """
        if process.health is None:
            return "heard" if process.name in self.heard() else "hung"
        if process.health.standing_by:
            return "stands by"
        return process.health.state if process.alive else "no token"

    def missing(self) -> list[str]:
        """Stages of the contract without a process."""
        present = {process.stage for process in self.processes if not (process.health and process.health.standing_by)}
        return [stage for stage in topics.STAGES if stage not in present]

    def doubled(self) -> list[str]:
        """Keys with more than one producer, as sentences."""
        found: dict[str, set[str]] = {}
        for process in self.processes:
            if process.health is None or not process.health.standing_by:
                found.setdefault(f"stage {process.stage}", set()).add(process.name)
            for item in process.health.inputs if process.health else []:
                found.setdefault(f"key {item.key}", set()).update(item.producers)
        return [f"{what} has {len(who)} producers: {', '.join(sorted(who))}" for what, who in found.items() if len(who) > 1]


def look(session: zenoh.Session, robot: str, cpu_over_s: float = 0.0) -> System:
    """Ask a system how it is; with `cpu_over_s` twice, that far apart, to see the processor time used in between."""
    tokens = alive_processes(session, robot)
    before: dict[tuple[str, str], TimedHealth] = {}
    if cpu_over_s:
        before, _ = get_timed_healths(session, robot)
        time.sleep(cpu_over_s)
    after, refused = get_timed_healths(session, robot)
    processes = [
        StageProcess(
            *who,
            alive=who in tokens,
            health=after[who].health if who in after else None,
            cpu_percent=_cpu_percent(before[who].health, after[who].health) if who in before and who in after else None,
            clock=_beside_ours([found[who].exchange for found in (before, after) if who in found]),
        )
        for who in sorted(tokens | set(after), key=_in_order)
    ]
    supervisors = [process for process in processes if process.stage == topics.SUPERVISOR]
    processes = [process for process in processes if process.stage != topics.SUPERVISOR]
    cameras, _ = get_all(session, topics.CAMERA_INFO.key(robot), CameraInfo)
    state = get_state(session, robot)
    camera = cameras[0][1] if cameras else None
    return System(robot, processes, camera, state, refused, versions_of("deixis-cli"), supervisors)


def alive_processes(session: zenoh.Session, robot: str) -> set[tuple[str, str]]:
    """(stage, instance) of the liveliness tokens that stand."""
    replies = session.liveliness().get(topics.alive_key(robot, "*", "*"), timeout=TOKENS_TIMEOUT_S)
    keys = [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]
    return {(key[-2], key[-1]) for key in keys}


def _in_order(who: tuple[str, str]) -> tuple[int, str, str]:
    stage, instance = who
    return topics.STAGES.index(stage) if stage in topics.STAGES else len(topics.STAGES), stage, instance


def _cpu_percent(before: Health, after: Health) -> float | None:
    if after.uptime_s <= before.uptime_s:
        return None
    return 100 * (after.cpu_s - before.cpu_s) / (after.uptime_s - before.uptime_s)


def _beside_ours(exchanges: list[Exchange]) -> Offset | None:
    """How far a clock is ahead of our wall clock now, by questions to it."""
    known = estimate(exchanges)
    return None if known is None else known.beside(time.time_ns() - time.monotonic_ns())
