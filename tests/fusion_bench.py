"""Fusion alone as a process behind a real router: the test plays the other stages on the keys of a robot of its own."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import zenoh
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import (
    Belief,
    CameraInfo,
    Gestures,
    HeadPoses,
    Health,
    Message,
    State,
    Target,
    Track,
    Tracks,
)

PATIENCE_S = 60.0
K = [560.0, 0.0, 319.5, 0.0, 560.0, 239.5, 0.0, 0.0, 1.0]


def wait_until(condition: Callable[[], Any], what: str) -> Any:
    deadline = time.monotonic() + PATIENCE_S
    while True:
        if value := condition():
            return value
        assert time.monotonic() < deadline, f"{what} did not come within {PATIENCE_S:g} s"
        time.sleep(0.02)


@contextmanager
def router() -> Iterator[str]:
    """Endpoint of a router on loopback."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        name = f"tcp/127.0.0.1:{listener.getsockname()[1]}"
    process = subprocess.Popen([sys.executable, "-m", "deixis_runtime.router", "--listen", name], stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: _answers(name), "the router")
        yield name
    finally:
        process.terminate()
        process.wait(10)


def _answers(endpoint: str) -> bool:
    with suppress(ConnectionError), open_client(endpoint, shared_memory=False):
        return True
    return False


class Bench:
    """A robot's keys with nothing but fusion on them; the test plays the other stages."""

    def __init__(self, session: zenoh.Session, endpoint: str, robot: str, folder: Path) -> None:
        """The registry and the log of fusion lie in `folder`."""
        self.session = session
        self.endpoint = endpoint
        self.robot = robot
        self.registry: Path | None = folder / "pois.sqlite"
        self.log = folder / "log"
        self.within: Sequence[str] = ()  # a command that starts fusion elsewhere, as `nsenter`
        self.beliefs: list[Belief] = []
        self.targets: list[Target] = []
        self.process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()
        self._declared = [
            session.declare_subscriber(topics.BELIEF.key(robot), lambda s: self._keep(self.beliefs, Belief, s)),
            session.declare_subscriber(topics.TARGET.key(robot), lambda s: self._keep(self.targets, Target, s)),
        ]

    def _keep(self, heard: list[Any], type_: type[Message], sample: zenoh.Sample) -> None:
        with self._lock:
            heard.append(codec.decode(type_, sample.payload.to_bytes(), str(sample.encoding)))

    def command(self, *more: str) -> list[str]:
        sets = ["--set", f"registry={self.registry}", *more] if self.registry else [*more]
        return [*self.within, sys.executable, "-c", "import sys; from deixis_fusion.service import main; sys.exit(main())",
                "--robot", self.robot, "--connect", self.endpoint, *sets]  # fmt: skip

    def start(self, *more: str) -> None:
        with self.log.open("a") as log:
            self.process = subprocess.Popen(self.command(*more), stderr=log, text=True)
        wait_until(lambda: self.replies("fusion/state"), "fusion's state")

    def stop(self, how: signal.Signals = signal.SIGTERM) -> int:
        assert self.process is not None
        self.process.send_signal(how)
        return self.process.wait(15)

    def kill(self) -> None:
        """End it by SIGKILL."""
        assert self.stop(signal.SIGKILL) == -signal.SIGKILL

    def key(self, path: str) -> str:
        """A key of this robot."""
        return f"deixis/{self.robot}/{path}"

    def replies(self, path: str, payload: bytes | None = None, encoding: str | None = None) -> list[zenoh.Reply]:
        selector = f"deixis/{self.robot}/{path}"
        return list(self.session.get(selector, payload=payload, encoding=encoding, timeout=5.0))

    def ask(self, path: str, payload: dict[str, Any] | None = None) -> tuple[str, str] | None:
        """("ok" or "refused", text) of the one reply to an edit; none where nobody answers on that key."""
        body = json.dumps(payload).encode() if payload is not None else None
        replies = self.replies(path, body, "application/json" if body else None)
        if not replies:
            return None
        (reply,) = replies
        if reply.ok is not None:
            return "ok", str(codec.decode_any(reply.ok.payload.to_bytes(), str(reply.ok.encoding)))
        assert reply.err is not None
        return "refused", reply.err.payload.to_string()

    def state(self, selector: str = "") -> State:
        answer = self._answer(f"fusion/state{selector}")
        return codec.decode(State, answer.payload.to_bytes(), str(answer.encoding), max_bytes=topics.STATE.max_bytes)

    def _answer(self, path: str) -> zenoh.Sample:
        """The answer to a get; on a busy machine that may take several."""

        def answered() -> zenoh.Sample | None:
            return next((reply.ok for reply in self.replies(path) if reply.ok is not None), None)

        return wait_until(answered, f"an answer to {path}")

    def health(self) -> Health:
        answer = self._answer("fusion/health")
        return codec.decode(Health, answer.payload.to_bytes(), str(answer.encoding))

    def put(self, topic: topics.Topic, message: Message) -> None:
        self.session.put(topic.key(self.robot), codec.encode(message), encoding=codec.encoding_of(type(message)))


@contextmanager
def fusion_bench(endpoint: str, folder: Path) -> Iterator[Bench]:
    """A bench with a session and a robot of its own; its fusion is killed at the end where it still runs."""
    with open_client(endpoint, shared_memory=False) as session:
        made = Bench(session, endpoint, f"t-{uuid.uuid4().hex[:12]}", folder)
        try:
            yield made
        finally:
            if made.process is not None and made.process.poll() is None:
                made.process.kill()
                made.process.wait(10)


def source(status: str, stage: str) -> Callable[[State], bool]:
    return lambda state: any(s.stage == stage and s.status == status for s in state.sources)


def camera_info(state: str = "streaming", last_seq: int = -1) -> CameraInfo:
    content = {"stamp_ns": 0, "stage": "camera", "instance": "c", "state": state, "source": "test", "width": 640, "height": 480}
    content["run"] = 1
    return CameraInfo.model_validate(content | {"camera_matrix": K, "last_seq": last_seq})


def of_frame(stage: str, seq: int, stamp_ns: int) -> dict[str, Any]:
    return {"run": 1, "seq": seq, "stamp_ns": stamp_ns, "stage": stage, "instance": "x"}


def face() -> Track:
    return Track.model_validate(
        {"track_id": 1, "person_id": 1, "kind": "face", "kind_probabilities": {"face": 1}, "centroid_px": (320, 240)}
        | {"bbox_px": (297, 210, 46, 60), "velocity_px_s": (0, 0)}
    )


def messages_of(seq: int, now_ns: int) -> list[tuple[topics.Topic, Message]]:
    """What the stages say of one frame of a person who points left and looks there, 2 m ahead."""
    pose = {"person_id": 1, "status": "tracking", "yaw_deg": 60.0, "yaw_sigma_deg": 3.0}
    hand = {"person_id": 1, "phase": "stroke", "gesture": "point_left", "bearing_deg": 60.0, "bearing_sigma_deg": 10.0}
    return [
        (topics.TRACKS, Tracks(**of_frame("tracker", seq, now_ns), width=640, height=480, tracks=[face()])),
        (topics.HEAD_POSES, HeadPoses.model_validate(of_frame("headpose", seq, now_ns) | {"poses": [pose]})),
        (topics.GESTURES, Gestures.model_validate(of_frame("gesture", seq, now_ns) | {"gestures": [hand]})),
    ]


def show(bench: Bench, seq: int, *, head: bool = True) -> None:
    """One frame of that person, until its belief is there."""
    for topic, message in messages_of(seq, time.time_ns()):
        if head or topic is not topics.HEAD_POSES:
            bench.put(topic, message)
    wait_until(lambda: bench.beliefs and bench.beliefs[-1].seq == seq, f"the belief of frame {seq}")
