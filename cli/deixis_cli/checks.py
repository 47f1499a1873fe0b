"""What can be wrong with a running system, and what to do about it: the knowledge behind `deixis doctor`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from deixis_runtime.clock_offset import Offset
from deixis_runtime.clock_watch import say_skew
from deixis_runtime.finding import Finding
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, Health, InputHealth, OutputHealth, State
from deixis_schemas.topics import By

from .system import HEARD_ONLY, StageProcess, System

SLOW_SHARE = 0.7
STALE_S = 2.0
SETTLED_S = 5.0


PER_FRAME = frozenset(topic.path for topic in topics.TOPICS if topic.by is By.FRAME)
RELEASE = "Deixis"
# What every tool that shows answers has to hear; the rest may be kept from it on purpose.
NEEDED_BY_TOOLS = (topics.BELIEF.path,)
SAME_VERSION = "install the same version of Deixis on both hosts; 'deixis doctor --json' on each names its own"
CLOCK_ADVICE = "ages are judged all the same, but stamps of the two are not comparable: run NTP or chrony on both"


@dataclass(frozen=True)
class Listening:
    """What was heard by listening: healths by stage, and whether an edit by get reaches fusion (none: not tried).

    may_edit: our certificate, if we have one, is of a role that may edit. `paths` are the topics listened to beside health, and
    whether anything came on each.
    """

    healths: frozenset[str]
    edits_reach_fusion: bool | None
    may_edit: bool = True
    paths: Mapping[str, bool] = field(default_factory=dict)


def findings(system: System, listening: Listening) -> list[Finding]:
    """All that is to be said of a system in which something is alive."""
    return [
        *missing_stages(system),
        *hung_stages(system),
        *ill_stages(system),
        *notes(system),
        *silenced(system, listening),
        *kept_from_us(system, listening),
        *unreadable(system),
        *versions(system),
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
        elif standing == "stands by":
            yield Finding("note", f"{process.name}: stands by, as before and after a hot swap: it works and is not heard")
        elif standing == "no token":
            yield Finding("note", f"{process.name}: answers but holds no liveliness token")


def ill_stages(system: System) -> Iterator[Finding]:
    """What stages say of themselves, and supervisors of them."""
    for process in (*system.processes, *system.supervisors):
        health = process.health
        if health is None:
            continue
        if health.state != "ok":
            yield Finding("wrong", f"{process.stage}: {health.state}: {health.reason}")
        elif process.alive:
            yield Finding("ok", f"{process.stage}: ok, step {health.step_ms_p50:.1f} ms, {health.rss_mb:.0f} MB")


def notes(system: System) -> Iterator[Finding]:
    """Conditions that stages show. What several of them show, as of their host's certificate, is said once."""
    found: dict[str, list[str]] = {}
    for process in system.processes:
        for note in process.health.notes if process.health else []:
            found.setdefault(note, []).append(process.stage)
    yield from (Finding("note", f"{', '.join(stages)}: {note}") for note, stages in found.items())


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
    if listening.edits_reach_fusion is False and not listening.may_edit:
        yield Finding("note", "fusion/poi: our gets on it do not reach fusion", "as meant: our certificate is not an editor's")
    elif listening.edits_reach_fusion is False:
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
    return [item.rate_hz for item in health.inputs if _path(item.key) in PER_FRAME]


def inputs(system: System) -> Iterator[Finding]:
    """Keys that a stage should hear and does not, or refuses."""
    streaming = system.camera is not None and system.camera.state == "streaming" and not system.camera.lockstep
    for process in system.processes:
        for item in process.health.inputs if process.health else []:
            yield from _refused(process, item)
            if streaming and _path(item.key) in PER_FRAME and _is_silent(process, item):
                yield _silence(system, process, item)


def _refused(process: StageProcess, item: InputHealth) -> Iterator[Finding]:
    if item.rejected:
        of_version = "this reader speaks" in item.last_error
        mend = "its producer breaks the contract of schemas/contract/topics.md: mend that, or stop it"
        what = f"{process.stage} refused {item.rejected} of {_path(item.key)}: {item.last_error}"
        yield Finding("wrong", what, f"two versions of the contract meet: {SAME_VERSION}" if of_version else mend)


def _is_silent(process: StageProcess, item: InputHealth) -> bool:
    young = process.health is None or process.health.uptime_s < SETTLED_S
    return not young and (item.age_s is None or item.age_s > STALE_S)


def _silence(system: System, process: StageProcess, item: InputHealth) -> Finding:
    """That a stage hears nothing on a key; and where both sides are seen, that the way between them keeps it."""
    since = "ever" if item.age_s is None else f"for {item.age_s:.0f} s"
    what = f"{process.stage} has heard no {_path(item.key)} {since}"
    if item.too_old and item.rate_hz > 0:
        return Finding(
            "wrong", f"{what} that was young enough", "the link is too slow for it: lower camera.rate_hz, size or quality"
        )
    publishers = list(publishing(system, item.key))
    if item.rejected or not publishers:
        return Finding("wrong", what, "see what is said of its producer")
    source, output = publishers[0]
    told = f"{source.stage} says that it published {output.published} of them, {output.rate_hz:.0f}/s now"
    ways = "the router" if _host(source) == _host(process) else f"the link from {_host(source)} to {_host(process)}"
    advice = f"{ways} or its access control keeps {_path(item.key)}: compare access_control in the settings of the routers"
    return Finding("wrong", f"{what}, but {told}", advice)


def publishing(system: System, key: str) -> Iterator[tuple[StageProcess, OutputHealth]]:
    """The processes that say that they publish on this key now."""
    for process in system.processes:
        for output in process.health.outputs if process.health else []:
            if output.key == key and output.rate_hz > 0:
                yield process, output


def kept_from_us(system: System, listening: Listening) -> Iterator[Finding]:
    """Topics that are published, and of which nothing comes to us: denied, or kept on the other host on purpose."""
    for path, heard in listening.paths.items():
        publishers = list(publishing(system, f"deixis/{system.robot}/{path}"))
        if heard or not publishers:
            continue
        source, output = publishers[0]
        what = f"{path}: {source.stage} publishes {output.rate_hz:.0f}/s of it, and we hear none"
        needed = path in NEEDED_BY_TOOLS
        yield Finding(
            "wrong" if needed else "note",
            what,
            "access control on the way denies it to us" + ("" if needed else "; of no matter if that is meant"),
        )


def unreadable(system: System) -> Iterator[Finding]:
    """Healths that were answered and that we cannot read."""
    for refusal in system.refused:
        yield Finding("wrong", f"{refusal.key}: its health cannot be read: {refusal.reason}", SAME_VERSION)


def versions(system: System) -> Iterator[Finding]:
    """Distributions that are not of the same version in all processes, ours included. Those that name none are left out."""
    found: dict[str, dict[str, set[str]]] = {}
    for who, installed in _installed(system):
        for name, version in installed.items():
            found.setdefault(_release(name), {}).setdefault(version, set()).add(who)
    for name, by_version in sorted(found.items()):
        if len(by_version) > 1:
            listed = "; ".join(f"{version}: {', '.join(sorted(who))}" for version, who in sorted(by_version.items()))
            ours = name == RELEASE
            yield Finding("wrong" if ours else "note", f"versions of {name} differ: {listed}", SAME_VERSION if ours else "")


def _installed(system: System) -> Iterator[tuple[str, Mapping[str, str]]]:
    yield "this command", system.ours
    for process in system.processes:
        if process.health is not None:
            yield f"{process.stage} on {process.health.host}", process.health.versions


def _release(distribution: str) -> str:
    return RELEASE if distribution.startswith("deixis-") else distribution


def clocks(system: System) -> Iterator[Finding]:
    """Hosts whose clocks differ from ours, and from each other as the stages see them."""
    told: set[str] = set()
    for process in system.processes:
        if process.health is None or process.clock is None or process.health.host in told:
            continue
        said = say_skew(f"host {process.health.host}", process.clock, "ours")
        if said:
            told.add(process.health.host)
            yield Finding("wrong", said, CLOCK_ADVICE)
    for process in system.processes:
        for item in process.health.clocks if process.health else []:
            offset = Offset(round(item.ahead_s * 1e9), round(item.uncertain_s * 1e9))
            said = say_skew(f"host {item.host} ({item.stage})", offset, f"that of host {_host(process)} ({process.stage})")
            if said:
                yield Finding("wrong", said, CLOCK_ADVICE)


def _host(process: StageProcess) -> str:
    return process.health.host if process.health is not None else "?"


def _path(key: str) -> str:
    return "/".join(key.split("/")[2:])


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
    heard = [process.health for process in processes if process.health and not process.health.standing_by]
    return [health for health in heard if health.uptime_s >= SETTLED_S]
