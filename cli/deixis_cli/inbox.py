"""Everything that one robot publishes, kept until a loop comes for it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, Message
from deixis_schemas.topics import Topic

from .raw_message import RawMessage

# A raw VGA frame is 0.9 MB: a slow reader holds 60 MB of them at most, and loses the oldest first.
MAX_FRAMES = 64
MAX_OTHERS = 20_000


@dataclass(frozen=True)
class Received:
    """One message as it came. `message` is none for a deleted key; of a frame the image bytes are left out."""

    key: str
    topic: Topic
    message: Message | None
    received_ns: int


@dataclass(frozen=True)
class _Stored:
    order: int
    received_ns: int
    sample: zenoh.Sample


class Inbox:
    """Zenoh callback and queue. `store` runs on Zenoh's threads, all else in the loop."""

    def __init__(self) -> None:
        self.lost = 0
        self.rejected = 0
        self.rejections: dict[str, str] = {}
        self._lock = threading.Lock()
        self._event = threading.Event()
        self._order = 0
        self._frames: deque[_Stored] = deque(maxlen=MAX_FRAMES)
        self._others: deque[_Stored] = deque(maxlen=MAX_OTHERS)

    def store(self, sample: zenoh.Sample) -> None:
        """Keep a sample. Past the bounds the oldest goes, frames apart from all else, and is counted in `lost`."""
        received_ns = time.time_ns()
        queue = self._frames if str(sample.key_expr).endswith("/" + topics.FRAME.path) else self._others
        with self._lock:
            self._order += 1
            self.lost += len(queue) == queue.maxlen
            queue.append(_Stored(self._order, received_ns, sample))
        self._event.set()

    def wait(self, timeout_s: float) -> None:
        """Wait for a sample, at most `timeout_s`."""
        self._event.wait(timeout_s)
        self._event.clear()

    def take_raw(self) -> Iterator[RawMessage]:
        """What came since the last call as it was sent, in its order, also what breaks the contract."""
        with self._lock:
            stored = [*self._frames, *self._others]
            self._frames.clear()
            self._others.clear()
        stored.sort(key=lambda item: item.order)
        return map(_raw, stored)  # one at a time: a second copy of all frames would be another 60 MB

    def take_all(self) -> list[Received]:
        """What came since the last call, in its order. What breaks the contract is counted in `rejected` and left out."""
        return [received for raw in self.take_raw() if (received := self.read(raw)) is not None]

    def read(self, raw: RawMessage) -> Received | None:
        """The message; none where it breaks the contract, which is counted in `rejected`."""
        topic = topics.topic_of(raw.key)
        if topic is None:
            self._reject(raw.key, "a key outside the contract")
            return None
        if raw.deleted:
            return Received(raw.key, topic, None, raw.received_ns)
        try:
            message = read_message(topic, raw.key, raw.payload, raw.encoding)
        except codec.CodecError as error:
            self._reject(raw.key, str(error))
            return None
        return Received(raw.key, topic, message, raw.received_ns)

    def _reject(self, key: str, why: str) -> None:
        self.rejected += 1
        if key in self.rejections or len(self.rejections) < 16:
            self.rejections[key] = why


def _raw(item: _Stored) -> RawMessage:
    sample = item.sample
    if sample.kind == zenoh.SampleKind.DELETE:
        return RawMessage(str(sample.key_expr), "", b"", item.received_ns, deleted=True)
    return RawMessage(str(sample.key_expr), str(sample.encoding), sample.payload.to_bytes(), item.received_ns)


def read_message(topic: Topic, key: str, payload: bytes, encoding: str) -> Message:
    """The message of a payload on this topic, a frame without its image bytes. Raises codec.CodecError.

    POIs may be JSON, as generic clients put them, and then take their id from the key.
    """
    if topic is topics.POI and not encoding.startswith(codec.MSGPACK):
        content = codec.parse_json(payload, max_bytes=topic.max_bytes)
        return codec.validate(topic.type, {"poi_id": key.rsplit("/", 1)[-1]} | content)
    message = codec.decode(topic.type, payload, encoding, max_bytes=topic.max_bytes)
    return message.model_copy(update={"data": b""}) if isinstance(message, Frame) else message
