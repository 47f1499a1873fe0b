"""What a stage says: messages of one topic, with the topic's delivery and label."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import zenoh
from deixis_schemas import codec
from deixis_schemas.messages import Message, OutputHealth
from deixis_schemas.topics import Topic

from .delivery import PROFILES
from .patient_puts import PatientPuts
from .rate import Rate


@dataclass(frozen=True)
class Aside:
    """Of a stage that may stand by: which messages are to be heard, and the key on which the others are said."""

    heard: Callable[[Message], bool]
    key: str


class Publisher:
    """Publishes messages of one topic on one key."""

    def __init__(
        self,
        session: zenoh.Session,
        topic: Topic,
        key: str,
        report: Callable[[str, str], None],
        *,
        lossless: bool = False,
        patient_puts: PatientPuts | None = None,
        aside: Aside | None = None,
    ) -> None:
        """`lossless` waits where a link is full instead of dropping: for lockstep, where a lost frame makes runs differ.

        That may take seconds; with `patient_puts` the loop is not held so long. `aside`: not all is to be heard.
        """
        profile = PROFILES[topic.delivery]
        self.key = key
        self.published = 0
        self.oversized = 0
        self._topic = topic
        self._report = report
        self._patient_puts = patient_puts
        self._rate = Rate(time.monotonic())
        self._aside = aside
        keys = (key,) if aside is None else (key, aside.key)
        self._publisher, *self._aside_publishers = (
            session.declare_publisher(
                said_on,
                encoding=codec.encoding_of(topic.type),
                congestion_control=zenoh.CongestionControl.BLOCK if lossless else zenoh.CongestionControl.DROP,
                priority=profile.priority,
                express=profile.express,
            )
            for said_on in keys
        )

    def put(self, message: Message) -> None:
        """Publish, unless the message is larger than the topic allows: readers would refuse it, so it is counted and said.

        Raises TypeError for a message of another type than the topic's.
        """
        if type(message) is not self._topic.type:
            raise TypeError(f"{self.key} carries {self._topic.type.__name__}, not {type(message).__name__}")
        heard = self._aside is None or self._aside.heard(message)
        payload = codec.encode(message)
        if len(payload) > self._topic.max_bytes:
            self.oversized += 1
            self._report(f"size {self.key}", f"{self.key}: not published: {oversize(len(payload), self._topic)}")
            return
        publisher = self._publisher if heard else self._aside_publishers[0]
        if self._patient_puts is None:
            publisher.put(payload)
        elif not self._patient_puts.do(lambda: publisher.put(payload)):
            return
        self.published += heard

    def matching(self) -> bool:
        """Whether somebody subscribes to the key."""
        return bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined]

    def health(self) -> OutputHealth:
        """Counters for the health record."""
        rate_hz = self._rate.of(self.published, time.monotonic())
        return OutputHealth(key=self.key, published=self.published, oversized=self.oversized, rate_hz=rate_hz)


def oversize(size: int, topic: Topic) -> str:
    """What is wrong with a payload of `size` bytes that the topic does not allow, in words."""
    return f"{size} bytes, more than the {topic.max_bytes} that '{topic.path}' allows"
