"""What a stage says: messages of one topic, with the topic's delivery and label."""

from __future__ import annotations

import time

import zenoh
from deixis_schemas import codec
from deixis_schemas.messages import Message, OutputHealth
from deixis_schemas.topics import Topic

from .delivery import PROFILES


class Publisher:
    """Publishes messages of one topic on one key."""

    def __init__(self, session: zenoh.Session, topic: Topic, key: str, *, lossless: bool = False) -> None:
        """`lossless` waits where a link is full instead of dropping: for lockstep, where a lost frame makes runs differ."""
        profile = PROFILES[topic.delivery]
        self.key = key
        self.published = 0
        self._topic = topic
        self._window = (time.monotonic(), 0)
        self._rate_hz = 0.0
        self._publisher = session.declare_publisher(
            key,
            encoding=codec.encoding_of(topic.type),
            congestion_control=zenoh.CongestionControl.BLOCK if lossless else zenoh.CongestionControl.DROP,
            priority=profile.priority,
            express=profile.express,
        )

    def put(self, message: Message) -> None:
        """Publish. Raises TypeError for a message of another type than the topic's."""
        if type(message) is not self._topic.type:
            raise TypeError(f"{self.key} carries {self._topic.type.__name__}, not {type(message).__name__}")
        self._publisher.put(codec.encode(message))
        self.published += 1

    def matching(self) -> bool:
        """Whether somebody subscribes to the key."""
        return bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined]

    def health(self) -> OutputHealth:
        """Counters for the health record."""
        now = time.monotonic()
        since, before = self._window
        if now - since >= 1.0:
            self._rate_hz = (self.published - before) / (now - since)
            self._window = (now, self.published)
        return OutputHealth(key=self.key, published=self.published, rate_hz=round(self._rate_hz, 2))
