"""One host's share of a robot's system: its router and its stages, started in order and watched."""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import Self

import zenoh
from deixis_schemas import topics
from deixis_schemas.messages import Message, Voice

from .hang_watch import HangWatch
from .launching import Forkable, ForkServer
from .leftovers import Leftovers, remove_unused
from .lineups import guest_command
from .link_security import LinkSecurity, SecurityError
from .newcomers import Newcomers, settings_of
from .notifications import Notifications
from .parent import SUPERVISED_BY
from .procfs import locked_inodes
from .queries import Query, Refused, check_names
from .router import router_config
from .session import DEFAULT_ENDPOINT, Unreachable, open_client
from .settings import CommonOptions, default_instance
from .socket_folder import PREFIX
from .stage import Node
from .supervisor import Supervisor
from .supervisor_health import account_of
from .watchdog import Patience

log = logging.getLogger("deixis-supervisor")

POLL_S = 0.02
# Longest until all are ready; a busy machine takes most of it for the guests' libraries.
START_S = 60.0
HELD_PERIOD_S = 0.5
GUEST_READY_S, GUEST_SILENT_S = 60.0, 3.0
"""What is borne where guests are among the stages: their libraries take seconds to load, and one frame of a large model on a
busy machine more than we bear of our own stages."""
ROUTER = "router"
ROUTER_COMMAND = (sys.executable, "-m", "deixis_runtime.router")
SOURCE = topics.FRAME.stage
"""The stage that all begins with."""


class HostFailed(RuntimeError):
    """The host's processes cannot do their work; the text says which and why."""


@dataclass(frozen=True)
class HostOptions:
    """What runs on a host, where it is reached, and how its links are guarded.

    fork: its processes are forked from one that has done their imports. guests: who stands in the place of stages, by stage
    (`lineups`).
    """

    robot: str
    stages: tuple[str, ...]
    site: Path | None = None
    listen: tuple[str, ...] = (DEFAULT_ENDPOINT,)
    connect: tuple[str, ...] = ()
    zenoh_config: Path | None = None
    security: LinkSecurity = field(default_factory=LinkSecurity)
    lockstep: bool = False
    sets: dict[str, tuple[str, ...]] = field(default_factory=dict)
    patience: Patience = field(default_factory=Patience)
    fork: bool = True
    guests: Mapping[str, str] = field(default_factory=dict)


def installed_stages() -> set[str]:
    """Names of the stages installed here: the entry points of the group `deixis.stages`."""
    return {item.name for item in entry_points(group="deixis.stages")}


def known_stages() -> tuple[str, ...]:
    """Stages installed here or named by the topic table: in the order of the table, the others behind by name."""
    return (*topics.STAGES, *sorted(installed_stages() - set(topics.STAGES)))


def chosen_stages(only: tuple[str, ...], without: tuple[str, ...]) -> tuple[str, ...]:
    """The stages to start: all that are installed, or `only` these, less `without`. Raises HostFailed for unknown ones."""
    installed, known = installed_stages(), known_stages()
    for name in (*only, *without):
        if name not in known:
            raise HostFailed(f"there is no stage '{name}'; known: {', '.join(known)}")
    for name in only:
        if name not in installed:
            raise HostFailed(f"stage '{name}' is not installed here (deixis-{name})")
    chosen = tuple(name for name in known if name in (only or installed) and name not in without)
    if not chosen:
        raise HostFailed("no stage is left to start" if installed else "no stage is installed here (deixis-camera, ...)")
    return chosen


class Host:
    """The processes of one host, and a Zenoh session of our own among them. Use as a context manager, then `start`."""

    def __init__(self, options: HostOptions) -> None:
        self.options = options
        self.supervisor = Supervisor()
        self.session: zenoh.Session
        self._stack = ExitStack()
        self._watch: HangWatch
        self._node: Node | None = None
        self._newcomers = Newcomers(self.supervisor, self._stage_command, default_instance)
        self._leftovers = Leftovers()
        self._held_looked_s = 0.0
        self._stopped: Callable[[], bool] = lambda: False

    def __enter__(self) -> Self:
        # A socket's path is limited to about 100 bytes, so not below the user's working directory.
        folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix=PREFIX)))
        self.endpoint = f"unixsock-stream/{folder}/router.sock"
        patience = self.options.patience
        if self.options.guests:
            patience = replace(
                patience, ready_s=max(patience.ready_s, GUEST_READY_S), silent_s=max(patience.silent_s, GUEST_SILENT_S)
            )
        notifications = self._stack.enter_context(Notifications(folder / "notify.sock", patience.silent_s))
        self._watch = HangWatch(notifications, patience)
        self.supervisor.environment = notifications.environment() | {SUPERVISED_BY: str(os.getpid())}
        return self

    def __exit__(self, *_: object) -> None:
        # The children first: a router that hangs would hold the end of our own session.
        self._note_held()
        self.supervisor.stop()
        self._node = None
        self._stack.close()
        self._note_held()
        self._remove_leftovers()

    @property
    def given_up(self) -> dict[str, str]:
        """Stages that ended too often and are not started again, with the reason. The others go on without them."""
        return {name: why for name, why in self.supervisor.failed().items() if name != ROUTER}

    def start(self, before_frames: Callable[[], None] | None = None, stopped: Callable[[], bool] = lambda: False) -> None:
        """Start the router, then the stages, the source last, when those who look at its frames are ready.

        `before_frames` is called with `session` open and before the first frame: to subscribe. `stopped` says whether to
        give up waiting. Raises HostFailed when one of them ends or is not ready in time.
        """
        self._stopped = stopped
        forks = ForkServer(self.forkables() if self.options.fork else [], stopped)
        self.supervisor.launch = self._stack.enter_context(forks).start
        self._start_router()
        self._start_stages(tuple(name for name in self.options.stages if name != SOURCE))
        if before_frames:
            before_frames()
        self._start_stages(tuple(name for name in self.options.stages if name == SOURCE))

    def poll(self) -> None:
        """Watch the children; call it several times a second. Raises HostFailed when the router or all stages are given up."""
        self.supervisor.poll()
        now_s = time.monotonic()
        self._watch.hear()
        for name, why in self._watch.hanging(self.supervisor.running(), now_s).items():
            self._note_held()
            self.supervisor.kill(name, why)
        if now_s - self._held_looked_s > HELD_PERIOD_S:
            self._held_looked_s = now_s
            self._note_held()
            self._remove_leftovers()
        if self._node is not None:
            self._newcomers.look(self._node.alive_processes(), now_s)
        self._tell(now_s)
        failed = self.supervisor.failed()
        if ROUTER in failed or (self.options.stages and failed.keys() >= set(self.options.stages)):
            raise HostFailed("; ".join(f"{name} is given up: {why}" for name, why in failed.items()))

    def _tell(self, now_s: float) -> None:
        """Say in health how the children fare, and answer who asks."""
        if self._node is None:
            return
        account = account_of(self.supervisor.processes.values(), now_s)
        for process in self.supervisor.processes:
            self._node.note(process, account.notes.get(process))
        for process, restarts in account.restarts.items():
            self._node.count_to(f"restarts_{process}", restarts)
        self._node.set_state(account.state, account.reason)
        self._node.wait(0.0)

    def _answer_voice(self, query: Query) -> list[tuple[str, Message]]:
        """Start a newcomer of a stage (`?op=start;stage=NAME`, settings as payload), stop it, or say how it fares (no `op`)."""
        assert self._node is not None
        check_names(query.parameters, ("op", "stage"))
        op, stage = query.parameters.get("op", ""), query.parameters.get("stage", "")
        if op == "start":
            instance = self._newcomers.start(stage, settings_of(query.payload), ROUTER)
        elif op == "stop":
            instance = self._newcomers.stop(stage, self._node.alive_processes())
        elif op:
            raise Refused(f"op: '{op[:40]}' is none of start, stop")
        else:
            instance = self._newcomers.instance(stage)
        name, me = self._node.producer
        told = Voice(stamp_ns=self._node.now_ns(), stage=name, instance=me, state="stands_by", other=instance)
        return [(topics.VOICE.key(self.options.robot, stage=name, id=me), told)]

    def _note_held(self) -> None:
        self._leftovers.note(set(self.supervisor.running().values()), locked_inodes())

    def _remove_leftovers(self) -> None:
        gone, removed = remove_unused(self._leftovers.left())
        self._leftovers.forget(gone)
        if removed:
            log.info("removed %d files of shared memory that a killed process left", removed)

    def forkables(self) -> list[Forkable]:
        """The router and our own stages, of which a test holds that their imports start no threads."""
        own = [item.name for item in entry_points(group="deixis.stages") if item.value == f"deixis_{item.name}.service:main"]
        stages = [name for name in self.options.stages if name in own and name not in self.options.guests]
        return [
            Forkable(ROUTER_COMMAND, "deixis_runtime.router:main"),
            *(Forkable((str(_script(name)),), f"deixis_{name}.service:main") for name in stages),
        ]

    def _start_router(self) -> None:
        options = self.options
        try:  # before anything starts, so that the reason is the last that is said
            router_config(list(options.listen), list(options.connect), options.zenoh_config, options.security)
        except (SecurityError, Unreachable) as error:
            raise HostFailed(str(error)) from None
        command = [*ROUTER_COMMAND, "--supervised", "--listen", self.endpoint]
        for endpoint in self.options.listen:
            command += ["--listen", endpoint]
        for endpoint in self.options.connect:
            command += ["--connect", endpoint]
        if self.options.zenoh_config:
            command += ["--config", str(self.options.zenoh_config)]
        command += ["--insecure"] if options.security.insecure else []
        command += ["--frames-stay"] if options.security.frames_stay else []
        self.supervisor.start(ROUTER, command)
        path = Path(self.endpoint.removeprefix("unixsock-stream/"))
        self._wait_until(path.exists, lambda: {ROUTER})
        self.session = self._stack.enter_context(open_client(self.endpoint, shared_memory=False))
        self._node = Node(self.session, topics.SUPERVISOR, self._node_options(), is_stage=False)
        voice = {"stage": topics.SUPERVISOR, "id": self._node.producer.instance}
        self._node.serve_get(topics.VOICE, self._answer_voice, **voice)

    def _node_options(self) -> CommonOptions:
        options = self.options
        return CommonOptions(
            robot=options.robot,
            instance=default_instance(),
            connect=self.endpoint,
            lockstep=False,
            supervised=False,
            started_before=0,
            site=None,
            sets=(),
        )

    def _start_stages(self, names: tuple[str, ...]) -> None:
        for name in names:
            self.supervisor.start(name, self._stage_command(name), needs=ROUTER)
        self._wait_until(lambda: not self._not_alive(names), lambda: self._not_alive(names))

    def _not_alive(self, names: tuple[str, ...]) -> set[str]:
        return set(names) - (self._node.alive_stages() if self._node else set())

    def _stage_command(self, name: str) -> list[str]:
        guest = self.options.guests.get(name)
        script = guest_command(name, guest) if guest else _script(name)
        if not script.exists():
            raise HostFailed(f"stage '{name}': its command {script.name} is not in {script.parent}")
        command = [str(script), "--supervised", "--robot", self.options.robot, "--connect", self.endpoint]
        if self.options.site:
            command += ["--site", str(self.options.site)]
        if self.options.lockstep:
            command.append("--lockstep")
        for item in self.options.sets.get(name, ()):
            command += ["--set", item]
        return command

    def _wait_until(self, ready: Callable[[], bool], missing: Callable[[], set[str]]) -> None:
        deadline = time.monotonic() + START_S
        while not ready():
            ended = [p for p in self.supervisor.processes.values() if not p.running]
            if ended:
                raise HostFailed(f"{', '.join(p.name for p in ended)} ended while starting; its message stands above")
            if self._stopped():
                raise HostFailed("stopped while starting")
            if time.monotonic() > deadline:
                late = ", ".join(sorted(missing()))
                raise HostFailed(f"not ready within {START_S:g} s: {late}; is this machine busy? What they log stands above")
            self._tell(time.monotonic())
            time.sleep(POLL_S)


def _script(stage: str) -> Path:
    """The command of a stage."""
    return Path(sys.executable).parent / f"deixis-{stage}"
