"""Brings the messages of a recording in the order of their frames: for lockstep, where a frame's messages go out together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from deixis_schemas.messages import FrameId, Message, OfFrame
from deixis_schemas.topics import Topic

# A stage that answers a frame does so within the age limit of the topics, or is not heard any more.
LOOK_AHEAD_NS = 1_500_000_000
MAX_AHEAD = 4096


@dataclass(frozen=True)
class Line:
    """One message of a recording, decoded. `message` is none for a deleted key."""

    key: str
    topic: Topic
    message: Message | None
    received_ns: int

    @property
    def frame_id(self) -> FrameId | None:
        """The frame that it speaks of; none where it speaks of none."""
        return self.message.frame_id if isinstance(self.message, OfFrame) else None


def by_frame(lines: Iterable[Line]) -> Iterator[list[Line]]:
    """Groups of lines: all of one frame, in their order, where its first stands; a line of no frame alone.

    Looks ahead 1.5 s of the recording at most; what is said of a frame later than that makes a group of its own.
    """
    ahead: list[Line] = []
    for line in lines:
        ahead.append(line)
        while ahead and (line.received_ns - ahead[0].received_ns > LOOK_AHEAD_NS or len(ahead) > MAX_AHEAD):
            yield _first_group(ahead)
    while ahead:
        yield _first_group(ahead)


def _first_group(ahead: list[Line]) -> list[Line]:
    """Take the first line, and those of its frame, out of `ahead`."""
    frame_id = ahead[0].frame_id
    if frame_id is None:
        return [ahead.pop(0)]
    group = [line for line in ahead if line.frame_id == frame_id]
    ahead[:] = [line for line in ahead if line.frame_id != frame_id]
    return group
