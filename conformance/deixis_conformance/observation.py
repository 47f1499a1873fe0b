"""What was fed to the stage under check, and what was heard of it, phase by phase: plain data for the checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from deixis_schemas import codec, topics
from deixis_schemas.messages import FrameId, Health, Message, OfFrame
from deixis_schemas.topics import By, Topic


@dataclass(frozen=True)
class Heard:
    """A message under one of the robot's keys. at_s: monotonic."""

    key: str
    encoding: str
    payload: bytes
    at_s: float

    @property
    def topic(self) -> Topic | None:
        """Its row of the table; none for a key outside the contract."""
        return topics.topic_of(self.key)


@dataclass(frozen=True)
class Fed:
    """A frame whose messages were given to the stage. at_s: when the last of them was, monotonic."""

    frame_id: FrameId
    stamp_ns: int
    at_s: float


@dataclass
class Phase:
    """A stretch of time. fed: what was given; heard: what came; running: whether the stage's process did so at its end.

    unheard: messages beyond what is kept of a phase.
    """

    name: str
    began_s: float
    ended_s: float = 0.0
    fed: list[Fed] = field(default_factory=list)
    heard: list[Heard] = field(default_factory=list)
    running: bool = True
    unheard: int = 0


@dataclass(frozen=True)
class Answer:
    """A valid message of the stage about a frame."""

    topic: Topic
    message: OfFrame
    at_s: float


@dataclass(frozen=True)
class Refused:
    """A message that breaks the contract, and how."""

    key: str
    why: str
    mislabelled: bool = False


def outputs_of(stage: str) -> tuple[Topic, ...]:
    """The topics on which the stage answers each frame."""
    return tuple(topic for topic in topics.TOPICS if topic.by is By.FRAME and topic.stage == stage)


def decoded(heard: Sequence[Heard]) -> tuple[list[tuple[Heard, Message]], list[Refused]]:
    """The valid messages, and what is wrong with the others."""
    good: list[tuple[Heard, Message]] = []
    bad: list[Refused] = []
    for item in heard:
        topic = item.topic
        if topic is None:
            bad.append(Refused(item.key, "a key outside the contract"))
            continue
        try:
            good.append((item, codec.decode(topic.type, item.payload, item.encoding, max_bytes=topic.max_bytes)))
        except codec.CodecError as error:
            bad.append(Refused(item.key, str(error), mislabelled=isinstance(error, codec.WrongType | codec.WrongVersion)))
    return good, bad


def answers(stage: str, phase: Phase) -> list[Answer]:
    """What the stage said of frames in a phase, valid messages alone, on the topics that each frame is answered on."""
    good, _ = decoded([item for item in phase.heard if item.topic in outputs_of(stage)])
    return [Answer(t, m, item.at_s) for item, m in good if isinstance(m, OfFrame) and (t := item.topic) is not None]


def healths(stage: str, phases: Sequence[Phase]) -> list[tuple[float, Health]]:
    """The stage's valid heartbeats, with when they were heard."""
    heard = [
        item for phase in phases for item in phase.heard if item.topic is topics.HEALTH and item.key.split("/")[2] == stage
    ]
    good, _ = decoded(heard)
    return [(item.at_s, message) for item, message in good if isinstance(message, Health)]
