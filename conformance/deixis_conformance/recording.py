"""What a stage under check is fed: a recorded run of a shipped clip (see ATTRIBUTION.md), frame by frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from deixis_cli.frame_groups import Line, by_frame
from deixis_cli.mcap_file import McapReader
from deixis_runtime.images import ImageError, decode_image
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, FrameId, Message, OfFrame
from deixis_schemas.topics import Topic

SHIPPED = Path(__file__).parent / "small.mcap"
# As many are fed at once at most; those of a long recording with pictures would fill the memory.
MOST_FRAMES = 64
LEAST_FRAMES = 40
# A recording may have a hole of hours.
LONGEST_GAP_S = 0.5
JPEG_QUALITY = 85


class RecordingError(ValueError):
    """A recording that a stage cannot be fed with; the text says why."""


@dataclass(frozen=True)
class Moment:
    """All messages of one frame by topic. after_s: since the first frame, where holes of the recording are short."""

    messages: dict[Topic, OfFrame]
    after_s: float


@dataclass(frozen=True)
class Recording:
    """The frames of a run, and what was said once beside them: lens, POIs, place."""

    moments: tuple[Moment, ...]
    once: dict[Topic, tuple[Message, ...]]


def read_recording(path: Path, inputs: Iterable[Topic]) -> Recording:
    """The first frames that all these inputs speak of. Raises RecordingError, or McapFileError for an unreadable file."""
    about_frames = [topic for topic in inputs if topic.max_age_s is not None]
    lines = (
        line
        for raw in McapReader(path)
        if not raw.deleted and (line := _line(raw.key, raw.payload, raw.encoding, raw.received_ns))
    )
    moments: list[Moment] = []
    once: dict[Topic, list[Message]] = {}
    for group in by_frame(lines):
        if len(moments) == MOST_FRAMES:
            break
        if group[0].frame_id is None:
            message = group[0].message
            if message is not None:
                once.setdefault(group[0].topic, []).append(message)
            continue
        messages = {line.topic: line.message for line in group if isinstance(line.message, OfFrame)}
        if all(topic in messages for topic in about_frames):
            moments.append(Moment(messages, _after_s(moments, messages)))
    if about_frames and len(moments) < LEAST_FRAMES:
        needed = ", ".join(topic.path for topic in about_frames)
        raise RecordingError(f"'{path}' holds {len(moments)} frames with all of {needed}; {LEAST_FRAMES} are needed")
    return Recording(tuple(moments), {topic: tuple(messages) for topic, messages in once.items()})


def _after_s(before: list[Moment], messages: dict[Topic, OfFrame]) -> float:
    if not before:
        return 0.0
    gap_s = (next(iter(messages.values())).stamp_ns - _stamp(before[-1])) / 1e9
    return before[-1].after_s + min(max(gap_s, 0.0), LONGEST_GAP_S)


def raw_frame(frame: Frame) -> Frame:
    """The frame with its picture as raw bytes, as the camera sends them on one host. Raises ImageError."""
    if frame.encoding != "jpeg":
        return frame
    picture = decode_image(frame)
    return frame.model_copy(update={"encoding": "bgr8", "data": picture.tobytes()})


def jpeg_frame(frame: Frame) -> Frame:
    """The frame with its picture as JPEG, as the camera sends them to another host. Raises ImageError."""
    if frame.encoding == "jpeg":
        return frame
    encoded, data = cv2.imencode(".jpg", decode_image(frame), (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    if not encoded:
        raise ImageError("data: no JPEG can be made of the picture")
    return frame.model_copy(update={"encoding": "jpeg", "data": np.asarray(data).tobytes()})


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
        if isinstance(message, Frame):
            decode_image(message)
    except (codec.CodecError, ImageError):
        return None  # of a recording of a living system: what broke the contract is not fed
    return Line(key, topic, message, received_ns)
