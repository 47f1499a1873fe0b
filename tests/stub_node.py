"""A node without a session: for tests of a stage's shell alone."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from deixis_schemas.messages import HealthState, Message, Producer
from deixis_schemas.topics import Topic


class Inbox:
    """What a subscription holds."""

    def __init__(self, key: str) -> None:
        self.key = key
        self.messages: list[Message] = []

    def take_all(self) -> list[Message]:
        taken, self.messages = self.messages, []
        return taken

    def take(self) -> Message | None:
        return (self.take_all() or [None])[-1]


class StubNode:
    """Hands the stage the messages of one turn of its loop after the other, and keeps what it says.

    `published` are its messages, `warnings` and `counters` all of them, `notes` and `states` (with their reasons) those of its
    health at the end of each turn.
    """

    def __init__(self, stage: str, turns: Sequence[Sequence[Message]]) -> None:
        self.producer = Producer(stage, "stub")
        self.published: list[Message] = []
        self.notes: list[dict[str, str]] = []
        self.warnings: list[str] = []
        self.states: list[tuple[HealthState, str]] = []
        self.counters: Counter[str] = Counter()
        self.robot = "r1"
        self._turns = iter(turns)
        self._first = True
        self._now: dict[str, str] = {}
        self._state: tuple[HealthState, str] = ("ok", "")
        self._inboxes: dict[type[Message], Inbox] = {}

    def subscribe(self, topic: Topic, **_bounds: int) -> Inbox:
        return self._inboxes.setdefault(topic.type, Inbox(topic.key(self.robot)))

    def publish(self, _topic: Topic) -> "StubNode":
        return self

    def put(self, message: Message) -> None:
        self.published.append(message)

    def wait(self) -> bool:
        if not self._first:
            self.notes.append(dict(self._now))
            self.states.append(self._state)
        self._first = False
        turn = next(self._turns, None)
        for message in turn or ():
            self._inboxes[type(message)].messages.append(message)
        return turn is not None

    @contextmanager
    def step(self) -> Iterator[None]:
        yield

    def set_state(self, state: HealthState, reason: str = "") -> None:
        self._state = (state, reason)

    def count(self, name: str, n: int = 1) -> None:
        self.counters[name] += n

    def warn(self, _kind: str, text: str) -> None:
        self.warnings.append(text)

    def note(self, key: str, text: str | None) -> None:
        self._now.pop(key, None)
        if text is not None:
            self._now[key] = text
