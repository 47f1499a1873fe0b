"""The robots' side of a fleet: each plays its recording on its own keys, over its own connection, at the clip's rate."""

from __future__ import annotations

import threading
import time
from typing import Any

import zenoh
from deixis_runtime.outputs import Publisher
from deixis_runtime.session import open_client
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, HeadPoses, Tracks
from fleet_recording import Robot, replayed

PLAYED = {topics.CAMERA_INFO: CameraInfo, topics.TRACKS: Tracks, topics.HEAD_POSES: HeadPoses}
INSTANCE = "recorded"
STOP_S = 10.0


class Player:
    """Plays one robot again and again in a thread of its own. Use as a context manager."""

    def __init__(self, robot: Robot, endpoint: str) -> None:
        self.robot = robot
        self.frames = 0
        self.late_s = 0.0
        self.failure = ""
        self._endpoint = endpoint
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"play-{robot.name}", daemon=True)

    def __enter__(self) -> Player:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(STOP_S)

    def _run(self) -> None:
        try:
            with open_client(self._endpoint, shared_memory=False) as session:
                self._play(session)
        except (zenoh.ZError, ConnectionError) as error:
            self.failure = f"{self.robot.name}: {error}"

    def _play(self, session: zenoh.Session) -> None:
        name = self.robot.name
        # Fusion waits for no stage that has no process.
        stages = [topics.FRAME.stage, *(topic.stage for topic in PLAYED)]
        tokens: list[Any] = [session.liveliness().declare_token(topics.alive_key(name, s, INSTANCE)) for s in set(stages)]
        info, tracks, poses = (Publisher(session, topic, topic.key(name), self._refuse) for topic in PLAYED)
        run, due_s = self.robot.first_run, time.monotonic()
        while not self._stop.is_set():
            recording = self.robot.recording
            info.put(recording.camera.model_copy(update={"run": run, "stamp_ns": time.time_ns()}))
            for said_tracks, said_poses in recording.frames:
                if self._stop.wait(max(0.0, due_s - time.monotonic())):
                    break
                self.late_s = max(self.late_s, time.monotonic() - due_s)
                stamp_ns = time.time_ns()
                tracks.put(replayed(said_tracks, run, stamp_ns))
                poses.put(replayed(said_poses, run, stamp_ns))
                self.frames += 1
                due_s += 1 / recording.rate_hz
            run += 1
        del tokens

    def _refuse(self, _kind: str, text: str) -> None:
        self.failure = text
