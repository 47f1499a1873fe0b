"""The layouts that `link.py` compares: how camera and the other stages are started on two hosts, and how they are stopped."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from deixis_schemas import topics

ROOT = Path(__file__).resolve().parents[1]
BIN = Path(sys.executable).parent
ROBOT = "bench"
PORT = 7447
STOP_S = 15.0
START_S = 60.0

LAYOUTS = {
    "adapted": "a router on each host, the camera adapts",
    "fixed": "a router on each host, the camera sends JPEGs of quality 85 at 30/s whatever happens",
    "peers": "no routers: the stages are peers, the camera as in `fixed`",
}


class LinkBenchError(RuntimeError):
    """A layout did not start, or ended while it was measured; the text has the end of its log."""


class Layout:
    """A robot with the camera and an edge with the rest, on two hosts. Use as a context manager; `heard` is what came.

    `camera` holds settings of the camera; with `frames` the listener on the edge reads frames as well.
    """

    def __init__(
        self,
        name: str,
        hosts: Any,
        folder: Path,
        source: Path,
        site: Path,
        camera: Mapping[str, object] = MappingProxyType({}),
        *,
        frames: bool = False,
    ) -> None:
        self.name, self.hosts, self.folder = name, hosts, folder
        self._frames = frames
        self.heard = {host: folder / f"{host}.jsonl" for host in hosts.names}
        self._camera: dict[str, object] = {"source": source, "loop": "true", **camera}
        if name != "adapted":
            self._camera |= {"encoding": "jpeg", "adapt": "false"}
        self._site = site
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._open = ExitStack()

    def __enter__(self) -> Self:
        if self.name == "peers":
            self._start_peers()
        else:
            self._start_routers()
        return self

    def __exit__(self, *_: object) -> None:
        for process in reversed(self._processes.values()):
            process.send_signal(signal.SIGTERM)
        for process in self._processes.values():
            try:
                process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._open.close()

    def check(self) -> None:
        """Raises LinkBenchError where a process has ended."""
        for name, process in self._processes.items():
            if process.poll() is not None:
                raise LinkBenchError(f"{self.name}: {name} ended with {process.returncode}: {self.log(name)}")

    def log(self, name: str, *, whole: bool = False) -> str:
        """What a process said: the end of it, or all."""
        text = (self.folder / f"{name}.log").read_text(errors="replace")
        return text if whole else text[-2000:]

    def _start_routers(self) -> None:
        robot, edge = self.hosts.names
        up = [BIN / "deixis", "up", "--robot", ROBOT, "--site", self._site]
        registry = ["--registry", self.folder / "pois.sqlite"]
        at_edge = f"tcp/{self.hosts.address[edge]}:{PORT}"
        self._start(edge, edge, [*up, "--except", "camera", *registry, "--listen", f"tcp/0.0.0.0:{PORT}", "--insecure"])
        self._start(robot, robot, [*up, "--only", "camera", "--connect", at_edge, *self._sets("camera.")])
        for host in self.hosts.names:
            self._wait_for(host, "started, reached at")
            self._listen(host, f"tcp/127.0.0.1:{PORT}")

    def _start_peers(self) -> None:
        robot, edge = self.hosts.names
        host_of = {stage: robot if stage == topics.FRAME.stage else edge for stage in topics.STAGES}
        names = [*topics.STAGES, f"listener-{robot}", f"listener-{edge}"]
        host_of |= {f"listener-{host}": host for host in self.hosts.names}
        at = {name: f"tcp/{self.hosts.address[host_of[name]]}:{PORT + index}" for index, name in enumerate(names)}
        for index, name in reversed(list(enumerate(names))):
            # Each links to those before it in the list, so that every pair has one link.
            peers = ",".join(at[other] for other in names[:index]) or at[name]
            if name not in topics.STAGES:
                self._listen(host_of[name], at[name], "--peers", peers)
                continue
            sets = self._sets("") if name == topics.FRAME.stage else []
            if name == topics.POI.stage:
                sets = ["--set", f'registry="{self.folder / "pois.sqlite"}"']
            launcher = [sys.executable, ROOT / "bench" / "peer_stage.py", name, at[name], peers]
            self._start(host_of[name], name, [*launcher, "--robot", ROBOT, "--site", self._site, *sets])

    def _listen(self, host: str, endpoint: str, *arguments: str) -> None:
        listener = [sys.executable, ROOT / "bench" / "link_listener.py", ROBOT, endpoint, self.heard[host]]
        also = ["--frames"] if self._frames and host == self.hosts.names[1] else []
        self._start(host, f"listener-{host}", [*listener, *also, *arguments])

    def _sets(self, prefix: str) -> list[str]:
        return [part for name, value in self._camera.items() for part in ("--set", f"{prefix}{name}={value}")]

    def _start(self, host: str, name: str, argv: Sequence[object]) -> None:
        log = self._open.enter_context((self.folder / f"{name}.log").open("ab"))
        self._processes[name] = self.hosts.popen(host, argv, stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def _wait_for(self, name: str, text: str) -> None:
        deadline_s = time.monotonic() + START_S
        while text not in self.log(name):
            self.check()
            if time.monotonic() > deadline_s:
                raise LinkBenchError(f"{self.name}: {name} is not ready within {START_S:g} s: {self.log(name)}")
            time.sleep(0.05)
