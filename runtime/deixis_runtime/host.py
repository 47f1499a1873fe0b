"""One host's share of a robot's system: its router and its stages, started in order and watched."""

from __future__ import annotations

import logging
import socket
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from pathlib import Path
from typing import Self

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health

from .launching import Forkable, ForkServer
from .limit import RateLimit
from .link_security import LinkSecurity, SecurityError
from .liveliness import AliveStages
from .router import SOCKET_FOLDER_PREFIX, router_config
from .session import DEFAULT_ENDPOINT, Unreachable, open_client
from .supervisor import Supervisor
from .watchdog import Patience, Watchdog

log = logging.getLogger("deixis-supervisor")

POLL_S = 0.05
ROUTER = "router"
ROUTER_COMMAND = (sys.executable, "-m", "deixis_runtime.router")
SOURCE = topics.FRAME.stage
"""The stage that all begins with."""


class HostFailed(RuntimeError):
    """The host's processes cannot do their work; the text says which and why."""


@dataclass(frozen=True)
class HostOptions:
    """What runs on a host, where it is reached, and how its links are guarded.

    fork: its processes are forked from one that has done their imports.
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
        self._alive: AliveStages
        self._watchdog = Watchdog(options.patience)
        self._heard: deque[tuple[int, int, float]] = deque()
        self._limit = RateLimit()
        self._declared: list[object] = []
        self._stopped: Callable[[], bool] = lambda: False

    def __enter__(self) -> Self:
        # A socket's path is limited to about 100 bytes, so not below the user's working directory.
        folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix=SOCKET_FOLDER_PREFIX)))
        self.endpoint = f"unixsock-stream/{folder}/router.sock"
        self._stack.callback(self.supervisor.stop)
        return self

    def __exit__(self, *_: object) -> None:
        self._declared.clear()
        self._stack.close()

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
        self.supervisor.launch = self._stack.enter_context(ForkServer(self.forkables() if self.options.fork else [])).start
        self._start_router()
        self._start_stages(tuple(name for name in self.options.stages if name != SOURCE))
        if before_frames:
            before_frames()
        self._start_stages(tuple(name for name in self.options.stages if name == SOURCE))

    def poll(self) -> None:
        """Watch the children; call it a few times a second. Raises HostFailed when the router or all stages are given up."""
        self.supervisor.poll()
        self._end_hanging()
        failed = self.supervisor.failed()
        if ROUTER in failed or (self.options.stages and failed.keys() >= set(self.options.stages)):
            raise HostFailed("; ".join(f"{name} is given up: {why}" for name, why in failed.items()))

    def _end_hanging(self) -> None:
        while self._heard:
            self._watchdog.beat(*self._heard.popleft())
        running = {
            process.name: process.popen.pid
            for process in self.supervisor.processes.values()
            if process.name != ROUTER and process.popen is not None and process.running
        }
        router = next(iter(self.session.info.routers_zid()), None)
        hanging = self._watchdog.hanging(running, None if router is None else str(router), time.monotonic())
        for name, why in hanging.items():
            self.supervisor.kill(name, why)

    def forkables(self) -> list[Forkable]:
        """The router and our own stages, of which a test holds that their imports start no threads."""
        own = [item.name for item in entry_points(group="deixis.stages") if item.value == f"deixis_{item.name}.service:main"]
        stages = [name for name in self.options.stages if name in own]
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
        self._stack.callback(self._declared.clear)
        robot = self.options.robot
        self._alive = AliveStages(self.session, robot)
        self._declared.append(self.session.declare_subscriber(topics.HEALTH.key(robot, stage="*"), self._note_health))

    def _start_stages(self, names: tuple[str, ...]) -> None:
        for name in names:
            self.supervisor.start(name, self._stage_command(name))
        self._wait_until(lambda: not self._not_alive(names), lambda: self._not_alive(names))

    def _not_alive(self, names: tuple[str, ...]) -> set[str]:
        return set(names) - self._alive.stages()

    def _stage_command(self, name: str) -> list[str]:
        script = _script(name)
        if not script.exists():
            raise HostFailed(f"stage '{name}' is registered but its command {script.name} is not beside {sys.executable}")
        command = [str(script), "--supervised", "--robot", self.options.robot, "--connect", self.endpoint]
        if self.options.site:
            command += ["--site", str(self.options.site)]
        if self.options.lockstep:
            command.append("--lockstep")
        for item in self.options.sets.get(name, ()):
            command += ["--set", item]
        return command

    def _wait_until(self, ready: Callable[[], bool], missing: Callable[[], set[str]]) -> None:
        ready_s = self.options.patience.ready_s
        deadline = time.monotonic() + ready_s
        while not ready():
            ended = [p for p in self.supervisor.processes.values() if not p.running]
            if ended:
                raise HostFailed(f"{', '.join(p.name for p in ended)} ended while starting; its message stands above")
            if self._stopped():
                raise HostFailed("stopped while starting")
            if time.monotonic() > deadline:
                raise HostFailed(f"not ready within {ready_s:g} s: {', '.join(sorted(missing()))}")
            time.sleep(POLL_S)

    def _note_health(self, sample: zenoh.Sample) -> None:
        try:
            health = codec.decode(Health, sample.payload.to_bytes(), str(sample.encoding))
        except codec.CodecError as error:
            # Whoever sends it counts as silent, and is killed for that: the cause has to be said.
            if self._limit.allow(str(sample.key_expr), time.monotonic()) is not None:
                log.warning("%s: a heartbeat that breaks the contract: %s", sample.key_expr, error)
            return
        if health.host == socket.gethostname():
            self._heard.append((health.pid, health.count, time.monotonic()))


def _script(stage: str) -> Path:
    """The command of a stage."""
    return Path(sys.executable).parent / f"deixis-{stage}"
