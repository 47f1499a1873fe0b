"""Listens to a robot for a feed."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager

import zenoh
from deixis_cli.raw_message import RawMessage
from deixis_schemas import topics
from deixis_schemas.topics import Delivery

from .feed import Feed


def keys_of(robot: str, *, pictures: bool) -> list[str]:
    """Of all that is published, or of all but the frames; each within one stage, as viewers are allowed."""
    shown = [topic for topic in topics.TOPICS if topic.delivery is not Delivery.REPLY]
    wanted = [topic for topic in shown if pictures or topic is not topics.FRAME]
    return [topic.key(robot, stage="*", id="*") for topic in wanted]


@contextmanager
def hear(session: zenoh.Session, keys: Sequence[str], feed: Feed) -> Iterator[None]:
    """Put into the feed what comes on the keys."""

    def store(sample: zenoh.Sample) -> None:
        key, now_ns = str(sample.key_expr), time.time_ns()
        if sample.kind == zenoh.SampleKind.DELETE:
            feed.put(RawMessage(key, "", b"", now_ns, deleted=True))
        else:
            feed.put(RawMessage(key, str(sample.encoding), sample.payload.to_bytes(), now_ns))

    with ExitStack() as stack:
        for key in keys:
            stack.callback(session.declare_subscriber(key, store).undeclare)
        yield
