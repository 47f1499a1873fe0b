"""Feeds the stage under check, phase by phase, and keeps what is heard of it."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import zenoh
from deixis_cli.gets import Refusal, get_all
from deixis_schemas import codec, topics
from deixis_schemas.messages import CameraInfo, Frame, FrameId, Health, Message, OfFrame, Produced
from deixis_schemas.topics import Delivery, Topic

from .garbage import garbage_for
from .observation import Fed, Heard, Phase
from .recording import Moment, Recording, jpeg_frame, raw_frame, renamed

WE = "check"
SETTLE_S = 0.5
MAX_HEARD = 20_000
MAX_BYTES = 512 << 20


class Examination:
    """One stage of one robot, over our session. `running` tells whether its process does, where we know."""

    def __init__(self, session: zenoh.Session, robot: str, stage: str, recording: Recording | None, subject_runs: Any) -> None:
        self.robot = robot
        self.stage = stage
        self.phases: list[Phase] = []
        self.put_garbage = 0
        self._session = session
        self._recording = recording
        self._subject_runs = subject_runs
        self._lock = threading.Lock()
        self._heard: list[Heard] = []
        self._heard_bytes = 0
        self._unheard = 0
        self._declared: list[Any] = []
        # No run of ours may be one that the stage knows from elsewhere.
        self._run = time.time_ns() // 1_000_000
        self._seq = 0
        self._inputs = topics.INPUTS[stage]

    def listen(self, *, all_keys: bool) -> None:
        """Hear the robot from now on; what we say ourselves is not among it.

        Without `all_keys` by keys that access control gives to all roles: of one that takes in frames, nothing would come.
        """
        for key in [f"deixis/{self.robot}/**"] if all_keys else watched_keys(self.robot, self.stage):
            self._declared.append(self._session.declare_subscriber(key, self._store))

    def speak(self) -> None:
        """Stand in for the stages that are listened to, and the camera: they are alive, their lens and place are known."""
        stages = {topic.stage for topic in self._inputs if topic.max_age_s is not None} | {topics.FRAME.stage}
        for stage in sorted(stages - {self.stage}):
            token = topics.alive_key(self.robot, stage, WE)
            self._declared.append(self._session.liveliness().declare_token(token))

    @contextmanager
    def phase(self, name: str) -> Iterator[Phase]:
        """A stretch of time: what is heard until it ends belongs to it."""
        self._take()
        current = Phase(name, time.monotonic())
        yield current
        heard, current.unheard = self._take()
        current.heard += heard
        current.ended_s = time.monotonic()
        current.running = self._subject_runs()
        self.phases.append(current)

    def tokens(self) -> list[str]:
        """The instances of the stage whose liveliness token stands."""
        key = topics.alive_key(self.robot, self.stage, "*")
        replies = self._session.liveliness().get(key, timeout=1.0)
        return sorted({str(reply.ok.key_expr).rsplit("/", 1)[-1] for reply in replies if reply.ok is not None})

    def others_alive(self) -> list[str]:
        """`stage/instance` of processes that speak for what the stage listens to."""
        replies = self._session.liveliness().get(topics.alive_key(self.robot, "*", "*"), timeout=1.0)
        names = {"/".join(str(reply.ok.key_expr).split("/")[-2:]) for reply in replies if reply.ok is not None}
        upstream = {topic.stage for topic in self._inputs if topic.max_age_s is not None}
        return sorted(name for name in names if name.split("/")[0] in upstream and not name.endswith(f"/{WE}"))

    def health_replies(self) -> tuple[int, str]:
        """How many valid answers a get of its health has, and why one was refused."""
        good, bad = get_all(self._session, topics.HEALTH.key(self.robot, stage=self.stage), Health)
        return len(good), _say(bad)

    def replies(self, topic: Topic, **parts: str) -> tuple[list[Message], str]:
        """The valid answers to a get on one of its topics, and why others were refused."""
        good, bad = get_all(self._session, topic.key(self.robot, **parts), topic.type)
        return [message for _, message in good], _say(bad)

    def json_reply(self, selector: str) -> str:
        """The first answer to a get as text, empty without one; for those who ask for JSON."""
        for reply in self._session.get(selector, timeout=1.5):
            if reply.ok is not None:
                text = reply.ok.payload.to_bytes().decode("utf-8", "replace")
                try:
                    return json.dumps(json.loads(text))
                except ValueError:
                    return ""
        return ""

    def edit(self, poi_id: str, content: dict[str, Any] | None) -> tuple[list[Message], str]:
        """An acknowledged edit of a POI, or its removal: the answers, and the refusal in words."""
        selector = topics.POI.key(self.robot, id=poi_id) + ("" if content is not None else "?op=delete")
        payload = b"" if content is None else json.dumps(content).encode()
        good, bad = get_all(self._session, selector, topics.POI.type, payload=payload, encoding=codec.JSON)
        return [message for _, message in good], _say(bad)

    # --- feeding ------------------------------------------------------------------------------------------------------

    def begin_run(self) -> None:
        """The camera begins anew; what is said once is said."""
        assert self._recording is not None
        self._run += 1
        self._seq = 0
        for topic in self._inputs:
            for message in self._recording.once.get(topic, ())[-MAX_ONCE:]:
                self._put(topic, self._of_now(message))

    def feed(self, phase: Phase, moments: Sequence[Moment], *, every_s: float | None = None, as_jpeg: bool = False,
             without: Topic | None = None, late_s: float = 0.0) -> None:  # fmt: skip
        """Say of each moment what the stage listens to, at the recording's rate or one each `every_s` seconds.

        without: an input that is left out. late_s: how long ago they were captured, by their stamps.
        """
        # Before the clock runs: on a busy machine the last of a burst would be too old before it is said.
        prepared = [_with_picture(moment, as_jpeg=as_jpeg) for moment in moments]
        began_s, began_ns = time.monotonic(), time.time_ns()
        first_s = moments[0].after_s
        for number, moment in enumerate(prepared):
            due_s = number * every_s if every_s is not None else moment.after_s - first_s
            time.sleep(max(0.0, began_s + due_s - time.monotonic()))
            stamp_ns = began_ns + round((time.monotonic() - began_s - late_s) * 1e9) + number
            phase.fed.append(self._say_moment(moment, stamp_ns, without=without))

    def put_garbage_on_inputs(self) -> None:
        """Every broken message on every input."""
        assert self._recording is not None
        for topic in self._inputs:
            valid = self._example(topic)
            if valid is None:
                continue
            for label, payload in garbage_for(topic, valid):
                self._session.put(topic.key(self.robot, id="broken"), payload, encoding=label, allowed_destination=REMOTE,
                                  congestion_control=zenoh.CongestionControl.BLOCK)  # fmt: skip
                self.put_garbage += 1
            self._session.delete(topic.key(self.robot, id="broken"), allowed_destination=REMOTE)

    def _say_moment(self, moment: Moment, stamp_ns: int, *, without: Topic | None) -> Fed:
        frame_id = FrameId(self._run, self._seq)
        self._seq += 1
        for topic in self._inputs:
            message = moment.messages.get(topic)
            if message is None or topic is without:
                continue
            named = renamed(message, frame_id, stamp_ns)
            self._put(topic, named.model_copy(update={"instance": WE}))
        return Fed(frame_id, stamp_ns, time.monotonic())

    def _example(self, topic: Topic) -> Message | None:
        assert self._recording is not None
        moments = self._recording.moments
        said_once = self._recording.once.get(topic, ())
        return said_once[0] if said_once else (moments[0].messages.get(topic) if moments else None)

    def _of_now(self, message: Message) -> Message:
        if isinstance(message, CameraInfo):
            return message.model_copy(
                update={"stamp_ns": time.time_ns(), "instance": WE, "lockstep": False, "run": self._run, "state": "streaming"}
            )
        if isinstance(message, Produced) and not isinstance(message, OfFrame):
            return message.model_copy(update={"stamp_ns": time.time_ns(), "instance": WE})
        return message

    def _put(self, topic: Topic, message: Message) -> None:
        parts = {"id": str(getattr(message, "poi_id", ""))} if topic is topics.POI else {}
        self._session.put(topic.key(self.robot, **parts), codec.encode(message), encoding=codec.encoding_of(topic.type),
                          allowed_destination=REMOTE, congestion_control=zenoh.CongestionControl.BLOCK)  # fmt: skip

    # --- hearing ------------------------------------------------------------------------------------------------------

    def _store(self, sample: zenoh.Sample) -> None:
        at_s = time.monotonic()
        if sample.kind != zenoh.SampleKind.PUT:
            return
        payload = sample.payload.to_bytes()
        with self._lock:
            self._heard_bytes += len(payload)
            if len(self._heard) < MAX_HEARD and self._heard_bytes < MAX_BYTES:
                self._heard.append(Heard(str(sample.key_expr), str(sample.encoding), payload, at_s))
            else:
                self._unheard += 1

    def _take(self) -> tuple[list[Heard], int]:
        """What came since the last call, and how many messages came beyond what is kept."""
        with self._lock:
            heard, self._heard = self._heard, []
            unheard, self._unheard = self._unheard, 0
            self._heard_bytes = 0
        return heard, unheard


MAX_ONCE = 32
REMOTE = zenoh.Locality.REMOTE


def watched_keys(robot: str, stage: str) -> list[str]:
    """What is heard beside a stage that runs: all of the stage, and of the others all but frames that it does not live on."""
    others = [topic for topic in topics.TOPICS if topic.delivery is not Delivery.REPLY and topic is not topics.HEALTH]
    wanted = [topic for topic in others if topic.stage != stage]
    if topics.TRACKS.stage != stage:
        wanted = [topic for topic in wanted if topic is not topics.FRAME]
    return [f"deixis/{robot}/{stage}/**", *(topic.key(robot, id="*") for topic in wanted)]


def _with_picture(moment: Moment, *, as_jpeg: bool) -> Moment:
    messages = dict(moment.messages)
    for topic, message in moment.messages.items():
        if isinstance(message, Frame):
            messages[topic] = jpeg_frame(message) if as_jpeg else raw_frame(message)
    return Moment(messages, moment.after_s)


def _say(refusals: Sequence[Refusal]) -> str:
    return "; ".join(f"{refusal.key}: {refusal.reason}" for refusal in refusals[:3])
