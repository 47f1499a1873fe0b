"""What a stage does so that another process can take its place between two frames: its keys, tokens and questions.

The rules are in `voice`. A process that is heard holds the liveliness token of its stage; one that stands by holds another one,
works on all that comes, and says what it would answer under `@standby/{stage}/`, where the command that swaps looks at it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import FrameId, Message, OfFrame, Producer, Voice
from deixis_schemas.topics import By, Topic

from .delivery import GET_PRIORITY
from .liveliness import AliveStages, StandingBy
from .outputs import Aside
from .queries import Query, Refused, check_names
from .voice import TAKE_WITHIN_S, Seen, YieldRefused
from .voice import Voice as Part

PARAMETERS = ("op", "to", "from")
MAX_HEARD = 64
MAX_REPLIES = 4


class Handover:
    """One process's part in changing places. All but the callbacks is called from the stage's loop."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        producer: Producer,
        alive: AliveStages,
        wake: Callable[[], None],
        *,
        standing_by: bool,
    ) -> None:
        """`standing_by`: it is a newcomer, which is not heard until it has taken the place of another."""
        self.part = Part(standing_by=standing_by)
        self.leaving = False
        self._session = session
        self._robot = robot
        self._producer = producer
        self._alive = alive
        self._wake = wake
        self._token: Any = None
        self._token_of_heard: bool | None = None
        self._spares: StandingBy | None = None
        self._lock = threading.Lock()
        self._heard: deque[zenoh.Sample] = deque(maxlen=MAX_HEARD)
        self._replies: deque[zenoh.Reply] = deque(maxlen=MAX_REPLIES)
        self._listening: list[Any] = []
        self._router = ""
        self._linked_since_s = 0.0

    # --- what the node asks -------------------------------------------------------------------------------------------

    @property
    def heard(self) -> bool:
        """Whether this process has its stage's place."""
        return self.part.heard

    def aside(self, topic: Topic, now_s: Callable[[], float]) -> Aside:
        """Which messages of a topic are not to be heard, and the key under which they are said then."""

        def allowed(message: Message) -> bool:
            return not isinstance(message, OfFrame) or self.part.answers(message.frame_id, now_s())

        return Aside(allowed, topics.standby_key(topic, self._robot))

    def others(self) -> set[str]:
        """Instances of this stage that are heard, but for this one."""
        stage, me = self._producer
        return {instance for name, instance in self._alive.processes() if name == stage} - {me}

    def turn(self, now_s: float, router: str) -> str:
        """One turn of the loop; what has happened, in words, or nothing. `router`: the one that we are linked to."""
        if router != self._router:
            self._router, self._linked_since_s = router, now_s
        self._take_heard()
        said = self._take_replies(now_s)
        if self.part.asks_in_vain(now_s):
            self.part.unanswered()
            said = f"not heard yet: {self.part.reason}"
        seen = Seen(self.others(), self._first_spare(), now_s - self._linked_since_s if router else 0.0, now_s)
        said = self.part.look(seen) or said
        if self.part.is_to_leave(now_s):
            self._leave()
        self._show()
        return said

    def declare(self) -> None:
        """Be there: only now, when all subscribers of the stage stand."""
        self._show()

    def answer(self, query: Query, now_s: float, now_ns: int) -> list[tuple[str, Message]]:
        """Answer a get of `{stage}/voice/{instance}`: how it stands, or what it is told to do by `op`. Raises Refused."""
        check_names(query.parameters, PARAMETERS)
        try:
            self._do(query.parameters, now_s)
        except YieldRefused as error:
            raise Refused(str(error)) from None
        self._show()
        return [(topics.VOICE.key(self._robot, stage=self._producer.stage, id=self._producer.instance), self.voice(now_ns))]

    def voice(self, now_ns: int) -> Voice:
        """How it stands."""
        part = self.part
        run, seq = part.fence if part.fence is not None else (None, None)
        stage, instance = self._producer
        return Voice(
            stamp_ns=now_ns,
            stage=stage,
            instance=instance,
            state=part.state,
            other=part.other,
            reason=part.reason,
            run=run,
            seq=seq,
        )

    # --- inside -------------------------------------------------------------------------------------------------------

    def _do(self, parameters: dict[str, str], now_s: float) -> None:
        op = parameters.get("op", "")
        if op == "yield":
            self.part.yield_to(_name(parameters, "to"), now_s)
        elif op == "take":
            self._ask(_name(parameters, "from"), now_s)
        elif op == "leave":
            if stays := self.part.must_stay(now_s):
                raise YieldRefused(stays)
            self._leave()
        elif op:
            raise YieldRefused(f"op: '{op[:40]}' is none of yield, take, leave")

    def _ask(self, other: str, now_s: float) -> None:
        self.part.ask(other, now_s)
        key = topics.VOICE.key(self._robot, stage=self._producer.stage, id=other)
        with self._lock:
            self._replies.clear()
        self._session.get(
            f"{key}?op=yield;to={self._producer.instance}", self._note_reply, timeout=TAKE_WITHIN_S, priority=GET_PRIORITY
        )

    def _note_reply(self, reply: zenoh.Reply) -> None:
        with self._lock:
            self._replies.append(reply)
        self._wake()

    def _take_replies(self, now_s: float) -> str:
        with self._lock:
            replies = list(self._replies)
            self._replies.clear()
        for reply in replies:
            if said := self._take_reply(reply, now_s):
                return said
        return ""

    def _take_reply(self, reply: zenoh.Reply, now_s: float) -> str:
        if reply.ok is None:
            why = reply.err.payload.to_bytes().decode("utf-8", "replace")[:300] if reply.err else "no answer"
            self.part.refused(f"{self.part.other}: {why}")
            return f"not heard yet: {self.part.reason}"
        try:
            told = codec.decode(Voice, reply.ok.payload.to_bytes(), str(reply.ok.encoding), max_bytes=topics.VOICE.max_bytes)
        except codec.CodecError as error:
            self.part.refused(f"{self.part.other}: its answer breaks the contract: {error}")
            return f"not heard yet: {self.part.reason}"
        if told.instance != self.part.other:  # of a question before this one
            return ""
        fence = None if told.run is None or told.seq is None else FrameId(told.run, told.seq)
        if not self.part.take(fence, now_s):
            return ""
        since = "the next frame" if fence is None else f"frame {fence.seq} of run {fence.run}"
        return f"takes the place of {told.instance} with {since}"

    def _take_heard(self) -> None:
        with self._lock:
            samples = list(self._heard)
            self._heard.clear()
        for sample in samples:
            topic = topics.topic_of(str(sample.key_expr))
            if topic is None or len(sample.payload) > topic.max_bytes:
                continue
            try:
                message = codec.decode(topic.type, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topic.max_bytes)
            except codec.CodecError:
                continue  # who reads the key counts it and says so
            if isinstance(message, OfFrame) and message.instance != self._producer.instance:
                self.part.hear(message.frame_id)

    def _store_heard(self, sample: zenoh.Sample) -> None:
        with self._lock:
            self._heard.append(sample)

    def _first_spare(self) -> bool:
        spares = self._spares.instances() if self._spares is not None else set()
        return min({*spares, self._producer.instance}) == self._producer.instance

    def _show(self) -> None:
        """Hold the token that says how we stand, and listen to who has the place while we have not."""
        heard = self.part.heard
        if heard == self._token_of_heard:
            return
        key = topics.alive_key if heard else topics.standby_alive_key
        before, self._token = self._token, self._session.liveliness().declare_token(key(self._robot, *self._producer))
        if before is not None:
            before.undeclare()
        self._token_of_heard = heard
        if heard:
            self._listening, self._spares = [], None
            return
        self._spares = StandingBy(self._session, self._robot, self._producer.stage)
        own = [topic for topic in topics.TOPICS if topic.by is By.FRAME and topic.stage == self._producer.stage]
        self._listening = [
            self._session.declare_subscriber(topic.key(self._robot), self._store_heard, allowed_origin=zenoh.Locality.REMOTE)
            for topic in own
        ]

    def _leave(self) -> None:
        self.leaving = True
        self._wake()


def _name(parameters: dict[str, str], parameter: str) -> str:
    """The instance that a parameter names. Raises YieldRefused."""
    name = parameters.get(parameter, "")
    if not topics.is_name(name):
        raise YieldRefused(f"{parameter}: '{name[:80]}' is no name of a process")
    return name
