"""What was heard, until it is drawn: bounded, and the oldest goes first, so that who draws slowly holds nobody up."""

from __future__ import annotations

import threading
from collections import deque

from deixis_cli.raw_message import RawMessage
from deixis_schemas import topics

# Pictures are held apart: of a slow viewer's the newest are of use, and all else is small.
MAX_PICTURES = 16
MAX_PICTURE_BYTES = 48 << 20
MAX_OTHERS = 2_000
MAX_OTHER_BYTES = 16 << 20


class Feed:
    """A queue between who hears and who draws. left_out: messages that went undrawn."""

    def __init__(self) -> None:
        self.left_out = 0
        self._lock = threading.Lock()
        self._event = threading.Event()
        self._order = 0
        self._pictures = _Queue(MAX_PICTURES, MAX_PICTURE_BYTES)
        self._others = _Queue(MAX_OTHERS, MAX_OTHER_BYTES)

    def put(self, message: RawMessage) -> None:
        """Keep a message; never waits."""
        queue = self._pictures if topics.topic_of(message.key) is topics.FRAME else self._others
        with self._lock:
            self._order += 1
            self.left_out += queue.put(self._order, message)
        self._event.set()

    def take(self, timeout_s: float) -> list[RawMessage]:
        """What has come since the last call, in its order; waits for something, at most `timeout_s`."""
        self._event.wait(timeout_s)
        self._event.clear()
        with self._lock:
            held = [*self._pictures.take(), *self._others.take()]
        return [message for _, message in sorted(held, key=lambda item: item[0])]


class _Queue:
    def __init__(self, most: int, most_bytes: int) -> None:
        self._most, self._most_bytes = most, most_bytes
        self._held: deque[tuple[int, RawMessage]] = deque()
        self._bytes = 0

    def put(self, order: int, message: RawMessage) -> int:
        """Keep it, and give up the oldest past the bounds: how many those are."""
        self._held.append((order, message))
        self._bytes += len(message.payload)
        given_up = 0
        while len(self._held) > 1 and (len(self._held) > self._most or self._bytes > self._most_bytes):
            self._bytes -= len(self._held.popleft()[1].payload)
            given_up += 1
        return given_up

    def take(self) -> list[tuple[int, RawMessage]]:
        held = list(self._held)
        self._held.clear()
        self._bytes = 0
        return held
