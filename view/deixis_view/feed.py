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

    def take(self, timeout_s: float) -> RawMessage | None:
        """The oldest message, which is then held no more; none where none comes within `timeout_s`."""
        message = self._pop()
        if message is None and timeout_s > 0:
            self._event.wait(timeout_s)
            message = self._pop()
        return message

    def _pop(self) -> RawMessage | None:
        with self._lock:
            self._event.clear()
            queues = [queue for queue in (self._pictures, self._others) if queue.held]
            return min(queues, key=lambda queue: queue.held[0][0]).pop() if queues else None


class _Queue:
    def __init__(self, most: int, most_bytes: int) -> None:
        self.held: deque[tuple[int, RawMessage]] = deque()
        self._most, self._most_bytes = most, most_bytes
        self._bytes = 0

    def put(self, order: int, message: RawMessage) -> int:
        """Keep it, and give up the oldest past the bounds: how many those are."""
        self.held.append((order, message))
        self._bytes += len(message.payload)
        given_up = 0
        while len(self.held) > 1 and (len(self.held) > self._most or self._bytes > self._most_bytes):
            self.pop()
            given_up += 1
        return given_up

    def pop(self) -> RawMessage:
        message = self.held.popleft()[1]
        self._bytes -= len(message.payload)
        return message
