"""Messages that break the contract, one for each way in which that is met."""

from __future__ import annotations

from collections.abc import Iterator

from deixis_schemas import codec
from deixis_schemas.messages import Message
from deixis_schemas.topics import Topic


def garbage_for(topic: Topic, valid: Message) -> Iterator[tuple[str, bytes]]:
    """(label, payload) pairs to put on the topic's key; `valid` is a message that the topic carries."""
    label, payload = codec.encoding_of(topic.type), codec.encode(valid)
    content = valid.model_dump()
    yield label, b""
    yield label, b"\xc1\xff\x00 no msgpack"
    yield label, payload[: len(payload) // 2]
    yield label, codec.pack({})
    yield label, b"\x93\x01\x02\x03"  # a list
    yield label, b"\x81" * 2000  # maps in maps
    yield "", payload
    yield "text/plain", payload
    yield label.rsplit("/", 1)[0] + "/999", payload
    yield "application/msgpack;Nothing/1", payload
    for name, value in content.items():
        yield label, codec.pack({**content, name: _wrong(value)})


def _wrong(value: object) -> object:
    """A value that no field of this kind may have."""
    return {"never": ["of", "this", "type"]} if not isinstance(value, dict) else -1
