"""What a stage under check is fed: a recorded run of a shipped clip (see ATTRIBUTION.md), frame by frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from deixis_cli.frame_groups import Line, by_frame
from deixis_cli.mcap_file import McapReader
from deixis_runtime.images import decode_image
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, FrameId, Message, OfFrame
from deixis_schemas.topics import Topic

SHIPPED = Path(__file__).parent / "small.mcap"


class RecordingError(ValueError):
    """A recording that a stage cannot be fed with; the text says why."""


@dataclass(frozen=True)
class Moment:
    """All messages of one frame by topic. after_s: since the first frame."""

    messages: dict[Topic, OfFrame]
    after_s: float


@dataclass(frozen=True)
class Recording:
    """The frames of a run, and what was said once beside them: lens, POIs, place."""

    moments: tuple[Moment, ...]
    once: dict[Topic, tuple[Message, ...]]


def read_recording(path: Path, inputs: Iterable[Topic]) -> Recording:
    """The frames that all these inputs speak of. Raises RecordingError, or McapFileError for a file that cannot be read."""
    about_frames = [topic for topic in inputs if topic.max_age_s is not None]
    lines = [
        line
        for raw in McapReader(path)
        if not raw.deleted and (line := _line(raw.key, raw.payload, raw.encoding, raw.received_ns))
    ]
    moments: list[Moment] = []
    once: dict[Topic, list[Message]] = {}
    for group in by_frame(lines):
        if group[0].frame_id is None:
            message = group[0].message
            if message is not None:
                once.setdefault(group[0].topic, []).append(message)
            continue
        messages = {line.topic: line.message for line in group if isinstance(line.message, OfFrame)}
        if all(topic in messages for topic in about_frames):
            first = next(iter(messages.values()))
            moments.append(Moment(messages, 0.0 if not moments else (first.stamp_ns - _stamp(moments[0])) / 1e9))
    if about_frames and not moments:
        needed = ", ".join(topic.path for topic in about_frames)
        raise RecordingError(f"'{path}' holds no frame with all of {needed}")
    return Recording(tuple(moments), {topic: tuple(messages) for topic, messages in once.items()})


def raw_frame(frame: Frame) -> Frame:
    """The frame with its picture as raw bytes, as the camera sends them on one host. Raises ImageError."""
    if frame.encoding != "jpeg":
        return frame
    picture = decode_image(frame)
    return frame.model_copy(update={"encoding": "bgr8", "data": picture.tobytes()})


def renamed(message: OfFrame, frame_id: FrameId, stamp_ns: int) -> OfFrame:
    """The message as said of another frame."""
    return message.model_copy(update={"run": frame_id.run, "seq": frame_id.seq, "stamp_ns": stamp_ns})


def _stamp(moment: Moment) -> int:
    return next(iter(moment.messages.values())).stamp_ns


def _line(key: str, payload: bytes, encoding: str, received_ns: int) -> Line | None:
    topic = topics.topic_of(key)
    if topic is None or topic in (topics.HEALTH, topics.STATE):
        return None
    try:
        message = codec.decode(topic.type, payload, encoding, max_bytes=topic.max_bytes)
    except codec.CodecError:
        return None  # of a recording of a living system: what broke the contract is not fed
    return Line(key, topic, message, received_ns)
