"""Whether those who listen to a topic are on this host: their health says which router they are clients of.

A host's name does not tell: containers of one host have different ones, and two hosts may bear the same.
"""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health, Producer
from deixis_schemas.topics import Topic

from .delivery import GET_PRIORITY
from .liveliness import AliveStages

ASK_EVERY_S = 2.0
TIMEOUT_S = 1.9
# A link that is cut for a while takes the processes beyond it out of sight, not out of the world.
REMEMBERED_S = 60.0
# A process without an answer for so long gives no health, as a guest may; it is no reason to think anything of it.
PATIENCE_S = 2.0
MAX_WAITING = 64


@dataclass(frozen=True)
class Reader:
    """A stage that listens to the topic: the host that it names, and whether its router is another than ours."""

    host: str
    elsewhere: bool
    heard_s: float


class Readers:
    """The stages that listen to one topic. The callback only keeps answers; decoding happens in `turn`, in the loop."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        topic: Topic,
        us: Producer,
        alive: AliveStages,
        our_router: Callable[[], str],
    ) -> None:
        """Of `topic` of a robot; `us` is who asks and needs no answer."""
        self._session = session
        self._selector = topics.HEALTH.key(robot, stage="*")
        self._key = topic.key(robot)
        self._us = us
        self._alive = alive
        self._our_router = our_router
        self._lock = threading.Lock()
        self._answers: list[tuple[bytes, str]] = []
        self._readers: dict[tuple[str, str], Reader] = {}
        self._answered: set[tuple[str, str]] = set()
        self._first_seen_s: dict[tuple[str, str], float] = {}
        self._next_s = 0.0

    def turn(self) -> None:
        """Take in what was answered; ask now and then, and where a process is new."""
        now_s = time.monotonic()
        # Of others than the contract's stages, as a supervisor, nothing is thought before they have answered.
        processes = {who for who in self._alive.processes() if who[0] in topics.STAGES and who != self._us}
        new = processes - self._first_seen_s.keys()
        self._first_seen_s = {who: self._first_seen_s.get(who, now_s) for who in processes}
        self._answered &= processes
        self._take_answers(now_s)
        self._readers = {who: reader for who, reader in self._readers.items() if now_s - reader.heard_s < REMEMBERED_S}
        if new or now_s >= self._next_s:
            self._next_s = now_s + ASK_EVERY_S
            self._session.get(
                self._selector,
                self._note,
                timeout=TIMEOUT_S,
                priority=GET_PRIORITY,
                congestion_control=zenoh.CongestionControl.DROP,
            )

    def elsewhere(self) -> set[str]:
        """Names of the other hosts on which somebody listens; in brackets the stage where a process has not said yet."""
        known = {reader.host for reader in self._readers.values() if reader.elsewhere}
        return known | {f"({stage})" for stage, _ in self.unsettled()}

    def unsettled(self) -> set[tuple[str, str]]:
        """Processes, (stage, instance), that came lately and have not answered yet."""
        now_s = time.monotonic()
        return {
            who for who, since_s in self._first_seen_s.items() if who not in self._answered and now_s - since_s < PATIENCE_S
        }

    def _note(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            with self._lock:
                if len(self._answers) < MAX_WAITING:
                    self._answers.append((reply.ok.payload.to_bytes(), str(reply.ok.encoding)))

    def _take_answers(self, now_s: float) -> None:
        with self._lock:
            answers, self._answers = self._answers, []
        if not answers:
            return  # as in nearly all turns, of which a camera has two a frame
        ours = self._our_router()
        for payload, encoding in answers:
            try:
                health = codec.decode(Health, payload, encoding)
            except codec.CodecError:
                continue  # whose health breaks the contract is named by those who read it
            who = (health.stage, health.instance)
            self._answered.add(who)
            if any(item.key == self._key for item in health.inputs):
                self._readers[who] = Reader(health.host, _is_elsewhere(health, ours), now_s)


def _is_elsewhere(health: Health, our_router: str) -> bool:
    """By the router; of a stage that does not tell it, by the host's name."""
    if health.router and our_router:
        return health.router != our_router
    return health.host != socket.gethostname()
