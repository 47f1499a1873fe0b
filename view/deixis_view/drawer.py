"""Draws what a feed holds, in a thread of its own: decodes, has the core say what is to be drawn, and hands it to the sink."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Protocol

from deixis_cli.raw_message import RawMessage
from deixis_runtime.limit import RateLimit
from deixis_schemas import codec, topics
from deixis_schemas.messages import Message
from deixis_schemas.topics import Topic

from .drawing import Layout, Shot
from .feed import Feed
from .scene import Scene

log = logging.getLogger("deixis-view")

TURN_S = 0.2


class Sink(Protocol):
    """Where shots go."""

    def lay_out(self, layout: Layout) -> None:
        """Lay out the views; before the first shot."""

    def draw(self, shot: Shot) -> bool:
        """Draw a shot; whether it was, or was left out. May wait."""


class Painter:
    """Takes raw messages to the sink. rejected: those that break the contract. shots: drawn; left_out: not drawn."""

    def __init__(self, scene: Scene, sink: Sink) -> None:
        self.rejected = 0
        self.left_out = 0
        self.shots = 0
        self._scene = scene
        self._sink = sink
        self._laid_out = False
        self._limit = RateLimit()

    def take(self, raw: RawMessage) -> None:
        """Draw what a message brings. What breaks the contract is counted, and said once in a while."""
        topic = topics.topic_of(raw.key)
        if topic is None:
            self._reject(raw, "a key outside the contract")
            return
        try:
            message = None if raw.deleted else read(topic, raw)
        except codec.CodecError as error:
            self._reject(raw, str(error))
            return
        for shot in self._scene.hear(raw.key, message, raw.received_ns):
            self._draw(shot)

    def tick(self, now_ns: int) -> None:
        """Draw what is due though nothing came."""
        for shot in self._scene.tick(now_ns):
            self._draw(shot)

    def _draw(self, shot: Shot) -> None:
        if not self._laid_out:
            self._sink.lay_out(self._scene.layout())
            self._laid_out = True
        if self._sink.draw(shot):
            self.shots += 1
        else:
            self.left_out += 1

    def _reject(self, raw: RawMessage, why: str) -> None:
        self.rejected += 1
        more = self._limit.allow(raw.key, time.monotonic())
        if more is not None:
            log.warning("%s: not drawn: %s%s", raw.key[:200], why, f" (and {more} more)" if more else "")


class Drawer:
    """The thread. Use as a context manager; at the end what is held is drawn, for `end_s` at most."""

    def __init__(self, feed: Feed, painter: Painter, end_s: float, *, clock_ns: Callable[[], int] = time.time_ns) -> None:
        self.failure = ""
        self._feed, self._painter = feed, painter
        self._end_s = end_s
        self._clock_ns = clock_ns
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="view", daemon=True)

    def __enter__(self) -> Drawer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(self._end_s)

    @property
    def done(self) -> bool:
        """Whether all was drawn, or given up."""
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            while self._turn(0.0 if self._stop.is_set() else TURN_S) or not self._stop.is_set():
                pass
        except Exception as error:  # a thread that dies must not look like a viewer that has nothing to show
            self.failure = f"{type(error).__name__}: {error}"
            log.exception("drawing has failed")

    def _turn(self, timeout_s: float) -> bool:
        """Draw one message, or what is due without one; whether there was one."""
        raw = self._feed.take(timeout_s)
        if raw is not None:
            self._painter.take(raw)
        self._painter.tick(self._clock_ns())
        return raw is not None


def read(topic: Topic, raw: RawMessage) -> Message:
    """The message of a payload, a frame with its picture. Raises codec.CodecError."""
    if topic is topics.POI and not raw.encoding.startswith(codec.MSGPACK):
        content = codec.parse_json(raw.payload, max_bytes=topic.max_bytes)
        return codec.validate(topic.type, {"poi_id": raw.key.rsplit("/", 1)[-1]} | content)
    return codec.decode(topic.type, raw.payload, raw.encoding, max_bytes=topic.max_bytes)
