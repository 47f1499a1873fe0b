"""Who speaks in a run besides its stages: the robot that says where it is, and the truth in place of a stage."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Protocol

import zenoh
from deixis_runtime.outputs import Publisher
from deixis_schemas import topics
from deixis_schemas.messages import Message, Producer
from deixis_schemas.topics import Topic

INSTANCE = "truth"
"""Of what evaluation says in a stage's place, so that nobody takes it for the stage."""


class Speaker(Protocol):
    """Says messages of one topic in answer to what it hears. Pure: the transport is `Speakers`."""

    topic: Topic

    def begin(self) -> Sequence[Message]:
        """What to say before the first frame."""
        ...

    def hear(self, message: Message) -> Sequence[Message]:
        """What to say now that this was published."""
        ...


def producer_of(topic: Topic) -> Producer:
    """The name under which a speaker on this topic speaks."""
    return Producer(topic.stage, INSTANCE)


class Speakers:
    """Publishes what some speakers say, in the thread that calls `hear`."""

    def __init__(self, speakers: Sequence[Speaker], robot: str, *, lockstep: bool) -> None:
        self._speakers = speakers
        self._robot = robot
        self._lockstep = lockstep
        self._publishers: list[Publisher] = []
        self.failures: list[str] = []

    @contextmanager
    def join(self, session: zenoh.Session) -> Iterator[None]:
        """Speak in this session's run: alive as the stages that are stood in for, and with what comes before the frames."""
        with ExitStack() as stack:
            for speaker in self._speakers:
                key = speaker.topic.key(self._robot)
                publisher = Publisher(session, speaker.topic, key, self._note, lossless=self._lockstep)
                self._publishers.append(publisher)
                token = session.liveliness().declare_token(topics.alive_key(self._robot, *producer_of(speaker.topic)))
                stack.callback(token.undeclare)
                for message in speaker.begin():
                    publisher.put(message)
            try:
                yield
            finally:
                self._publishers.clear()

    def hear(self, message: Message) -> None:
        """Let each speaker answer a message."""
        for speaker, publisher in zip(self._speakers, self._publishers, strict=False):
            for answer in speaker.hear(message):
                publisher.put(answer)

    def _note(self, _kind: str, text: str) -> None:
        self.failures.append(text)
