"""Says again what a recording holds of some stages, in their place: at its own rate, or in lockstep with those that run."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, Self

import zenoh
from deixis_runtime.outputs import Publisher
from deixis_runtime.session import first_line
from deixis_schemas import codec, topics
from deixis_schemas.messages import CameraInfo, Frame, FrameId, Message, OfFrame
from deixis_schemas.topics import By, Delivery, Topic

from .frame_groups import Line, by_frame
from .inbox import Inbox, read_message
from .mcap_file import McapFileError, McapReader
from .pace import Pace
from .raw_message import RawMessage
from .restamp import Restamper

log = logging.getLogger("deixis-replay")

ANSWER_TIMEOUT_S = 10.0
MOST_UNANSWERED = 3
TELL_OF_HOLE_S = 3.0
STOP_S = 5.0
# What is not said by a stage that is replaced, but is the place that all of it happened in.
CONTEXT = (topics.CAMERA_INFO, topics.ROBOT_POSE)


class Replayer:
    """Plays a recording in a thread of its own, over the session of the run. Use as a context manager.

    failure: why it ended before its end, or empty. unanswered: frames of lockstep that were not answered in time.
    """

    def __init__(
        self, path: Path, robot: str, replayed: Collection[str], running: Collection[str], *, lockstep: bool, pois: bool
    ) -> None:
        """`replayed` are the stages spoken for, `running` those that listen. `pois`: edit the registry as recorded."""
        self.failure = ""
        self.unanswered = 0
        self._unanswered_in_a_row = 0
        self.frames = 0
        self._path = path
        self._robot = robot
        self._replayed = frozenset(replayed)
        self._answering = [topic for topic in topics.TOPICS if topic.by is By.FRAME and topic.stage in running]
        # A stage that was too slow for a frame when it was recorded has said nothing of it that others could answer.
        self._answerable = {topic for topic in (topics.FRAME, topics.TRACKS) if topic.stage in self._replayed}
        self._lockstep = lockstep
        self._pois = pois
        self._stop = threading.Event()
        self._answers = Inbox()
        self._answered: dict[str, FrameId] = {}
        self._missing: list[str] = []
        self._publishers: dict[str, Publisher] = {}
        self._camera: CameraInfo | None = None
        self._last: OfFrame | None = None
        # Until we are left, also past the end: a stage that is gone counts for nothing in answers that are still to come.
        self._declared: list[Any] = []
        self._session: zenoh.Session
        self._thread = threading.Thread(target=self._run, name="replay", daemon=True)

    def on(self, session: zenoh.Session) -> Self:
        """Play over this session once entered."""
        self._session = session
        return self

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(STOP_S)
        self._declared.clear()

    def is_over(self) -> bool:
        """Whether all has been said."""
        return not self._thread.is_alive()

    # --- in the thread ------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        self._declared += [self._session.declare_subscriber(t.key(self._robot), self._answers.store) for t in self._answering]
        instance = f"replay-{os.getpid()}"
        tokens = [topics.alive_key(self._robot, stage, instance) for stage in sorted(self._replayed)]
        self._declared += [self._session.liveliness().declare_token(token) for token in tokens]
        try:
            self._play(instance)
        except McapFileError as error:
            self.failure = str(error)
        except zenoh.ZError as error:
            self.failure = f"Zenoh: {first_line(error)}"
        finally:
            self._say_ended()

    def _play(self, instance: str) -> None:
        reader = McapReader(self._path)
        lines = self._lines(reader)
        if self._lockstep:
            for group in by_frame(lines):
                if self._stop.is_set():
                    return
                self._feed(group)
                if self._unanswered_in_a_row == MOST_UNANSWERED:
                    self.failure = f"{MOST_UNANSWERED} frames in a row were not answered on {', '.join(self._missing)}"
                    return
        else:
            self._play_at_own_rate(lines, instance)
        if reader.cut:
            log.warning("%s", reader.cut_off)

    def _play_at_own_rate(self, lines: Iterator[Line], instance: str) -> None:
        pace, began_s = Pace(), time.monotonic()
        restamper: Restamper | None = None
        for line in lines:
            after_s = pace.after_s(line)
            wait_s = began_s + after_s - time.monotonic()
            if wait_s > TELL_OF_HOLE_S:
                log.warning("'%s' has a hole: nothing is said for %.0f s (--lockstep does not wait)", self._path, wait_s)
            if self._stop.wait(max(0.0, wait_s)):
                return
            message = line.message
            if restamper is None and isinstance(message, OfFrame | CameraInfo):
                # What was stamped `late` ns before it was heard is so again.
                late_ns = 0 if pace.by_stamps else line.received_ns - message.stamp_ns
                shift_ns = time.time_ns() - late_ns - message.stamp_ns
                restamper = Restamper(shift_ns, time.time_ns() // 1_000_000, instance)
            self._say(line, restamper.now(message) if restamper and message is not None else message)

    def _feed(self, group: list[Line]) -> None:
        """Say all of one frame, and wait for the answers of those who run."""
        for line in group:
            self._say(line, line.message)
        frame_id = group[0].frame_id
        if frame_id is None or not self._answerable <= {line.topic for line in group}:
            return
        until_s = time.monotonic() + ANSWER_TIMEOUT_S
        while self._without_answer(frame_id) and not self._stop.is_set():
            if time.monotonic() > until_s:
                self.unanswered += 1
                self._unanswered_in_a_row += 1
                self._missing = self._without_answer(frame_id)
                return
            self._answers.wait(0.1)
            for received in self._answers.take_all():
                if isinstance(received.message, OfFrame):
                    self._answered[received.topic.path] = received.message.frame_id
        self._unanswered_in_a_row = 0

    def _without_answer(self, frame_id: FrameId) -> list[str]:
        return [topic.path for topic in self._answering if self._answered.get(topic.path) != frame_id]

    def _say(self, line: Line, message: Message | None) -> None:
        key = _key_of(self._robot, line.key)
        if message is None:
            self._session.delete(key)
            return
        if isinstance(message, Frame):
            self.frames += 1
        if isinstance(message, OfFrame):
            self._last = message
        if isinstance(message, CameraInfo):
            self._camera = message
        self._publisher(line.topic, key).put(message)

    def _publisher(self, topic: Topic, key: str) -> Publisher:
        if key not in self._publishers:
            self._publishers[key] = Publisher(self._session, topic, key, _report, lossless=self._lockstep)
        return self._publishers[key]

    def _say_ended(self) -> None:
        """The camera's last word, where the recording does not hold it: those who wait for the end would wait for ever."""
        camera, last = self._camera, self._last
        if camera is not None and camera.state == "ended":
            return
        stage = topics.CAMERA_INFO.stage
        known = camera or CameraInfo(
            state="ended", source=self._path.name, stamp_ns=time.time_ns(), stage=stage, instance="replay"
        )
        frame = {"run": last.run, "last_seq": last.seq, "stamp_ns": last.stamp_ns} if last else {"last_seq": -1}
        ended = known.model_copy(update={"state": "ended", **frame})
        self._publisher(topics.CAMERA_INFO, topics.CAMERA_INFO.key(self._robot)).put(ended)

    # --- what of the recording is said --------------------------------------------------------------------------------

    def _lines(self, reader: McapReader) -> Iterator[Line]:
        broken = 0
        for raw in reader:
            topic = topics.topic_of(raw.key)
            if topic is None or not self._is_said(raw.key, topic):
                continue
            try:
                message = None if raw.deleted else _read(topic, raw)
            except codec.CodecError as error:
                broken += 1
                if broken == 1:
                    log.warning("'%s': %s: left out, as every reader would: %s", self._path, raw.key, error)
                continue
            yield Line(raw.key, topic, message, raw.received_ns)

    def _is_said(self, key: str, topic: Topic) -> bool:
        if topic in CONTEXT:
            return True
        if topic is topics.POI:
            return self._pois
        return key.split("/")[2] in self._replayed and topic is not topics.HEALTH and topic.delivery is not Delivery.REPLY


def _read(topic: Topic, raw: RawMessage) -> Message:
    if topic is topics.FRAME:  # with its picture, which `read_message` leaves out
        return codec.decode(topic.type, raw.payload, raw.encoding, max_bytes=topic.max_bytes)
    return read_message(topic, raw.key, raw.payload, raw.encoding)


def _key_of(robot: str, key: str) -> str:
    """The key on another robot."""
    first, _, rest = key.split("/", 2)
    return f"{first}/{robot}/{rest}"


def _report(_kind: str, text: str) -> None:
    log.warning("%s", text)
