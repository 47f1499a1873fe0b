"""What can be wrong with a running system, and what to do about it: the knowledge behind `deixis doctor`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, Health, State
from deixis_schemas.topics import By

from .system import HEARD_ONLY, StageProcess, System

Level = Literal["ok", "note", "wrong"]

CLOCK_S = 0.3
SLOW_SHARE = 0.7
STALE_S = 2.0
SETTLED_S = 5.0


@dataclass(frozen=True)
class Finding:
    """One thing found: whether it is wrong, what it is, and what to do."""

    level: Level
    what: str
    advice: str = ""


@dataclass(frozen=True)
class Listening:
    """What was heard by listening: healths by stage, and whether an edit by get reaches fusion (none: not tried)."""

    healths: frozenset[str]
    edits_reach_fusion: bool | None


def findings(system: System, listening: Listening) -> list[Finding]:
    """All that is to be said of a system in which something is alive."""
    return [
        *missing_stages(system),
        *hung_stages(system),
        *ill_stages(system),
        *silenced(system, listening),
        *doubled(system),
        *camera_state(system.camera),
        *rates(system),
        *inputs(system),
        *clocks(system),
        *registry(system.state),
    ]


def missing_stages(system: System) -> Iterator[Finding]:
    """Stages of the contract that nobody runs. An output that is heard all the same comes from a stand-in."""
    heard = {producer.split("/")[0] for producer in system.heard()}
    for stage in system.missing():
        if stage in heard:
            yield Finding("note", f"{stage}: not one of the runtime's stages, but its messages are heard")
        else:
            yield Finding("wrong", f"{stage}: no process of it is alive", f"start it: deixis up --only {stage} ...")


def hung_stages(system: System) -> Iterator[Finding]:
    """Processes with a token that answer nothing, or answer without a token. A guest that is heard need not give health."""
    for process in system.processes:
        standing = system.standing(process)
        if standing == "heard":
            yield Finding("note", f"{process.name}: {HEARD_ONLY}")
        elif standing == "hung":
            yield Finding(
                "wrong",
                f"{process.name}: alive but gives no answer",
                "it hangs or is stopped (SIGSTOP): restart it; or access control denies gets on its health key",
            )
        elif standing == "no token":
            yield Finding("note", f"{process.name}: answers but holds no liveliness token")


def ill_stages(system: System) -> Iterator[Finding]:
    """What stages say of themselves."""
    for process in system.processes:
        health = process.health
        if health is None:
            continue
        if health.state != "ok":
            yield Finding("wrong", f"{process.stage}: {health.state}: {health.reason}")
        elif process.alive:
            yield Finding("ok", f"{process.stage}: ok, step {health.step_ms_p50:.1f} ms, {health.rss_mb:.0f} MB")
        yield from (Finding("note", f"{process.stage}: {note}") for note in health.notes)


def silenced(system: System, listening: Listening) -> Iterator[Finding]:
    """Access control denies without a word: a session opens, and data vanish."""
    answering = {process.stage for process in system.processes if process.health is not None and process.alive}
    unheard = sorted(answering - listening.healths)
    if unheard:
        yield Finding(
            "wrong",
            f"{', '.join(unheard)}: health is answered to a get but not heard by listening",
            "access control on the way denies subscriptions, or the stage's own publications",
        )
    if topics.STATE.stage in answering and system.state is None:
        yield Finding("wrong", "fusion/state: a get is not answered", "access control on the way denies it")
    if listening.edits_reach_fusion is False:
        yield Finding("wrong", "fusion/poi: an edit by get does not reach fusion", "access control on the way denies it")


def doubled(system: System) -> Iterator[Finding]:
    """Two producers of one key."""
    for text in system.doubled():
        yield Finding("wrong", text, "stop one of them, or give each system its own --robot")


def camera_state(camera: CameraInfo | None) -> Iterator[Finding]:
    """Whether the camera delivers."""
    if camera is None:
        return
    if camera.state in ("retrying", "failed"):
        yield Finding(
            "wrong", f"camera: {camera.state}: {camera.reason}", "check the source: deixis up --set camera.source=..."
        )
    elif camera.state == "ended":
        yield Finding("note", f"camera: {camera.reason}; play a file again and again with --loop")
    else:
        yield Finding("ok", f"camera: {camera.state}, {camera.source}, {camera.width} x {camera.height}")


def rates(system: System) -> Iterator[Finding]:
    """Stages that keep up with what they are given, by the topic table: the slow one is named, not all behind it."""
    camera = system.camera
    if camera is None or camera.state != "streaming" or camera.lockstep:
        return
    for topic in topics.TOPICS:
        if topic.by is not By.FRAME or topic.rate_hz is None:
            continue
        for health in _settled(system, topic.stage):
            # The table names the rate of an ordinary camera; this one may be slower or faster.
            expected_hz = min([camera.rate_hz or topic.rate_hz, *_given_hz(health)])
            rate_hz = next((item.rate_hz for item in health.outputs if item.key.endswith("/" + topic.path)), 0.0)
            if rate_hz < SLOW_SHARE * expected_hz:
                step = f"its step takes {health.step_ms_p50:.0f} ms"
                advice = f"{step}; lower the camera's rate_hz or size, or free the processor"
                yield Finding("wrong", f"{topic.path}: {rate_hz:.1f}/s, expected {expected_hz:.0f}/s", advice)


def _given_hz(health: Health) -> list[float]:
    """Rates of the inputs that come with each frame."""
    per_frame = {topic.path for topic in topics.TOPICS if topic.by is By.FRAME}
    return [item.rate_hz for item in health.inputs if "/".join(item.key.split("/")[2:]) in per_frame]


def inputs(system: System) -> Iterator[Finding]:
    """Keys that a stage should hear and does not, or refuses."""
    streaming = system.camera is not None and system.camera.state == "streaming" and not system.camera.lockstep
    per_frame = {topic.path for topic in topics.TOPICS if topic.by is By.FRAME}
    for process in system.processes:
        for item in process.health.inputs if process.health else []:
            path = "/".join(item.key.split("/")[2:])
            if item.rejected:
                advice = "its producer breaks the contract of schemas/contract/topics.md: mend that, or stop it"
                yield Finding("wrong", f"{process.stage} refused {item.rejected} of {path}: {item.last_error}", advice)
            young = process.health is None or process.health.uptime_s < SETTLED_S
            if streaming and path in per_frame and not young and (item.age_s is None or item.age_s > STALE_S):
                since = "ever" if item.age_s is None else f"for {item.age_s:.0f} s"
                yield Finding("wrong", f"{process.stage} has heard no {path} {since}", "see what is said of its producer")


def clocks(system: System) -> Iterator[Finding]:
    """Hosts whose clocks differ from ours: ages are judged across hosts."""
    told: set[str] = set()
    for process in system.processes:
        ahead_s = process.clock_ahead_s
        if process.health is None or ahead_s is None or abs(ahead_s) < CLOCK_S or process.health.host in told:
            continue
        told.add(process.health.host)
        way = "ahead of" if ahead_s > 0 else "behind"
        yield Finding(
            "wrong", f"the clock of host {process.health.host} is {abs(ahead_s):.1f} s {way} ours", "run NTP or chrony on both"
        )


def registry(state: State | None) -> Iterator[Finding]:
    """Points of interest, and the edits that were refused."""
    if state is None:
        return
    if not state.pois_total:
        yield Finding("wrong", "there are no points of interest", "give a --site with pois, or: deixis poi add ID X Y Z")
    else:
        yield Finding("ok", f"{state.pois_total} points of interest in {state.registry_path}")
    for edit in state.rejected_edits[-3:]:
        yield Finding("note", f"an edit of {edit.key} was refused: {edit.reason}")


def _settled(system: System, stage: str) -> list[Health]:
    """Health of a stage's processes that are past their start."""
    processes: list[StageProcess] = [process for process in system.processes if process.stage == stage]
    return [process.health for process in processes if process.health and process.health.uptime_s >= SETTLED_S]
