"""One host's share of a robot's system: its router and its stages, started in order and watched."""

from __future__ import annotations

import logging
import socket
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from pathlib import Path
from typing import Self

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health

from .router import SOCKET_FOLDER_PREFIX
from .session import DEFAULT_ENDPOINT, open_client
from .supervisor import Supervisor

log = logging.getLogger("deixis-supervisor")

READY_TIMEOUT_S = 30.0
POLL_S = 0.05
HANGS_AFTER_S = 6.0
BLIND_AFTER_S = 3.0


class HostFailed(RuntimeError):
    """The host's processes cannot do their work; the text says which and why."""


@dataclass(frozen=True)
class HostOptions:
    """What runs on a host and where it is reached."""

    robot: str
    stages: tuple[str, ...]
    site: Path | None = None
    listen: tuple[str, ...] = (DEFAULT_ENDPOINT,)
    connect: tuple[str, ...] = ()
    zenoh_config: Path | None = None
    lockstep: bool = False
    sets: dict[str, tuple[str, ...]] = field(default_factory=dict)


def installed_stages() -> dict[str, str]:
    """Stages installed here, by name, with their distribution: the entry-point group `deixis.stages`."""
    return {item.name: item.dist.name if item.dist else "" for item in entry_points(group="deixis.stages")}


def chosen_stages(only: tuple[str, ...], without: tuple[str, ...]) -> tuple[str, ...]:
    """The stages to start: those of the contract, or `only` these, less `without`. Raises HostFailed for unknown ones."""
    installed = installed_stages()
    wanted = [name for name in (only or topics.STAGES) if name not in without]
    known = {*installed, *topics.STAGES}
    for name in (*only, *without):
        if name not in known:
            raise HostFailed(f"there is no stage '{name}'; installed: {', '.join(sorted(installed)) or 'none'}")
    for name in wanted:
        if name not in installed:
            raise HostFailed(f"stage '{name}' is not installed here (deixis-{name}); use --except {name}?")
    return tuple(wanted)


class Host:
    """The processes of one host, and a Zenoh session of our own among them. Use as a context manager, then `start`."""

    def __init__(self, options: HostOptions) -> None:
        self.options = options
        self.supervisor = Supervisor()
        self.session: zenoh.Session
        self._stack = ExitStack()
        self._alive: set[str] = set()
        self._beats: dict[int, tuple[int, float]] = {}
        self._polled_s = time.monotonic()
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

    def start(self, before_camera: Callable[[], None] | None = None, stopped: Callable[[], bool] = lambda: False) -> None:
        """Start the router, then the stages, the camera last, when those who look at its frames are ready.

        `before_camera` is called with `session` open and before the first frame: to subscribe. `stopped` says whether to
        give up waiting. Raises HostFailed.
        """
        self._stopped = stopped
        self._start_router()
        others = tuple(name for name in self.options.stages if name != "camera")
        for name in others:
            self.supervisor.start(name, self._stage_command(name))
        self._wait_until(lambda: set(others) <= self._alive_stages(), lambda: sorted(set(others) - self._alive_stages()))
        if before_camera:
            before_camera()
        if "camera" in self.options.stages:
            self.supervisor.start("camera", self._stage_command("camera"))

    def poll(self) -> None:
        """Watch the children; call it a few times a second. Raises HostFailed when one is given up."""
        self.supervisor.poll()
        now = time.monotonic()
        # Without a link, or when we ourselves stood still, silence says nothing of the stages.
        if now - self._polled_s > BLIND_AFTER_S or not self.session.info.routers_zid():
            self._beats.clear()
        self._polled_s = now
        for process in self.supervisor.processes.values():
            beat = self._beats.get(process.popen.pid) if process.popen else None
            if beat and process.running and now - beat[1] > HANGS_AFTER_S:
                self.supervisor.kill(process.name, f"gives no heartbeat for {HANGS_AFTER_S:.0f} s")
            elif not beat and process.name != "router" and process.running and now - process.spawned_s > READY_TIMEOUT_S:
                self.supervisor.kill(process.name, f"gave no heartbeat within {READY_TIMEOUT_S:.0f} s of its start")
        failed = self.supervisor.failed()
        if failed:
            raise HostFailed("; ".join(f"{name} is given up: {why}" for name, why in failed.items()))

    def _start_router(self) -> None:
        command = [sys.executable, "-m", "deixis_runtime.router", "--supervised", "--listen", self.endpoint]
        for endpoint in self.options.listen:
            command += ["--listen", endpoint]
        for endpoint in self.options.connect:
            command += ["--connect", endpoint]
        if self.options.zenoh_config:
            command += ["--config", str(self.options.zenoh_config)]
        self.supervisor.start("router", command)
        path = Path(self.endpoint.removeprefix("unixsock-stream/"))
        self._wait_until(path.exists, lambda: ["router"])
        self.session = self._stack.enter_context(open_client(self.endpoint, shared_memory=False))
        self._stack.callback(self._declared.clear)
        robot = self.options.robot
        self._declared.append(
            self.session.liveliness().declare_subscriber(topics.alive_key(robot, "*", "*"), self._note_alive, history=True)
        )
        self._declared.append(self.session.declare_subscriber(topics.HEALTH.key(robot, stage="*"), self._note_health))

    def _stage_command(self, name: str) -> list[str]:
        script = Path(sys.executable).parent / f"deixis-{name}"
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

    def _wait_until(self, ready: Callable[[], bool], missing: Callable[[], list[str]]) -> None:
        deadline = time.monotonic() + READY_TIMEOUT_S
        while not ready():
            ended = [p for p in self.supervisor.processes.values() if not p.running]
            if ended:
                raise HostFailed(f"{', '.join(p.name for p in ended)} ended while starting; its message stands above")
            if self._stopped():
                raise HostFailed("stopped while starting")
            if time.monotonic() > deadline:
                raise HostFailed(f"not ready within {READY_TIMEOUT_S:.0f} s: {', '.join(missing())}")
            time.sleep(POLL_S)

    def _alive_stages(self) -> set[str]:
        return {key.split("/")[-2] for key in tuple(self._alive)}

    def _note_alive(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._alive.add(key)
        else:
            self._alive.discard(key)

    def _note_health(self, sample: zenoh.Sample) -> None:
        try:
            health = codec.decode(Health, sample.payload.to_bytes(), str(sample.encoding))
        except codec.CodecError as error:
            log.debug("%s: %s", sample.key_expr, error)
            return
        last = self._beats.get(health.pid)
        if health.host == socket.gethostname() and (last is None or health.count != last[0]):
            self._beats[health.pid] = (health.count, time.monotonic())
