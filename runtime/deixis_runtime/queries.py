"""Gets answered and edits heard, both handed to the stage's loop: in a Zenoh callback nothing may block or call Zenoh."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import zenoh
from deixis_schemas import codec
from deixis_schemas.messages import Message
from deixis_schemas.plain_text import shown
from deixis_schemas.topics import Topic

from .outputs import oversize

MAX_WAITING = 64
MAX_WAITING_BYTES = 16 << 20
# Edits are small and each counts: a registry put POI by POI comes in one burst. Only a flood gets here.
MAX_EDITS = 10_000
MAX_EDIT_BYTES = 32 << 20

Report = Callable[[str, str], None]


class Refused(ValueError):
    """A get that cannot be answered as asked; the text goes to the asker."""


@dataclass(frozen=True)
class Query:
    """One get: `key` is the selector's key expression, `payload` what the asker sent along."""

    key: str
    parameters: dict[str, str] = field(default_factory=dict)
    payload: bytes | None = None
    encoding: str = ""


@dataclass(frozen=True)
class Edit:
    """One put or delete on a key that a stage keeps."""

    key: str
    kind: Literal["put", "delete"]
    payload: bytes
    encoding: str


Answer = Callable[[Query], list[tuple[str, Message]]]


class QueryQueue:
    """Gets on one key expression of a topic, waiting for the loop."""

    def __init__(self, topic: Topic, answer: Answer, wake: Callable[[], None], report: Report) -> None:
        self.lost = 0
        self._topic = topic
        self._answer = answer
        self._wake = wake
        self._report = report
        self._lock = threading.Lock()
        self._waiting: deque[zenoh.Query] = deque()
        self._crowded_out: deque[zenoh.Query] = deque()
        self._bytes = 0
        self._begun: Iterator[None] | None = None

    def store(self, query: zenoh.Query) -> None:
        """Callback of the Zenoh queryable. Past the bound the oldest is refused or, by a flood, left without answer."""
        size = _size(query)
        with self._lock:
            if self._bytes + size > MAX_WAITING_BYTES:
                self.lost += 1
                return
            self._bytes += size
            self._waiting.append(query)
            if len(self._waiting) > MAX_WAITING:
                self.lost += 1
                self._crowded_out.append(self._waiting.popleft())
            if len(self._crowded_out) > MAX_WAITING:
                self._bytes -= _size(self._crowded_out.popleft())
        self._wake()

    def answer_until(self, deadline_s: float) -> bool:
        """Answer those who wait, until this time of the monotonic clock; called from the loop. Whether more is to be done.

        At least one reply is given, however late it is. An answer of many replies may be spread over several calls.
        """
        while True:
            if self._begun is None:
                query = self._next()
                if query is None:
                    return False
                self._begun = self._answer_one(query)
            if next(self._begun, self) is self:
                self._begun = None
            if time.monotonic() >= deadline_s:
                with self._lock:
                    return bool(self._begun or self._waiting or self._crowded_out)

    def _next(self) -> zenoh.Query | None:
        """Who is to be answered next. Those to be refused are refused first: that takes no time."""
        with self._lock:
            crowded_out = list(self._crowded_out)
            self._crowded_out.clear()
            query = self._waiting.popleft() if self._waiting else None
            self._bytes -= sum(_size(taken) for taken in (*crowded_out, query) if taken is not None)
        for refused in crowded_out:
            self._refuse(refused, f"busy: more than {MAX_WAITING} gets wait")
            refused.drop()  # type: ignore[no-untyped-call]
        return query

    def _answer_one(self, query: zenoh.Query) -> Iterator[None]:
        """Give the replies one by one; with the last one it is over, and the asker waits no longer."""
        try:
            yield from self._replies(query)
        except Refused as error:
            self._refuse(query, str(error))
        except zenoh.ZError as error:
            self._report("reply", f"{query.key_expr}: cannot reply: {error}")
        finally:
            query.drop()  # type: ignore[no-untyped-call]

    def _refuse(self, query: zenoh.Query, why: str) -> None:
        try:
            query.reply_err(why.encode(), encoding="text/plain")
        except zenoh.ZError as error:
            self._report("reply", f"{query.key_expr}: cannot reply: {error}")

    def _replies(self, query: zenoh.Query) -> Iterator[None]:
        """Give the replies, with a pause between each two. Raises Refused, zenoh.ZError."""
        parameters = {str(name): str(value) for name, value in dict(query.parameters).items()}  # type: ignore[call-overload]
        wanted = parameters.get("format", "msgpack")
        if wanted not in ("msgpack", "json"):
            raise Refused(f"format: '{wanted[:40]}' is neither 'msgpack' nor 'json'")
        payload = query.payload.to_bytes() if query.payload is not None else None
        if payload is not None and len(payload) > self._topic.max_bytes:
            raise Refused(f"payload: {oversize(len(payload), self._topic)}")
        encoding = str(query.encoding) if query.encoding is not None else ""
        for number, (key, message) in enumerate(self._answer(Query(str(query.key_expr), parameters, payload, encoding))):
            if number > 0:
                yield
            content = codec.encode_json(message) if wanted == "json" else codec.encode(message)
            if len(content) > self._topic.max_bytes:
                what = f"{key}: reply of {oversize(len(content), self._topic)}"
                self._report(f"reply size {key}", what)
                raise Refused(f"{what}; ask for less, with ?top=N or ?poi=ID")
            query.reply(key, content, encoding=codec.JSON if wanted == "json" else codec.encoding_of(type(message)))


def _size(query: zenoh.Query) -> int:
    return len(query.payload) if query.payload is not None else 0


class EditQueue:
    """Puts and deletes on one key expression, waiting for the loop in their order."""

    def __init__(self, key: str, wake: Callable[[], None], report: Report) -> None:
        self.lost = 0
        self._key = key
        self._wake = wake
        self._report = report
        self._lock = threading.Lock()
        self._waiting: deque[zenoh.Sample] = deque()
        self._bytes = 0
        self._said = 0

    def store(self, sample: zenoh.Sample) -> None:
        """Callback of the Zenoh subscriber. Past the bounds the newest is lost: an edit already heard is not forgotten."""
        size = len(sample.payload)
        with self._lock:
            if len(self._waiting) >= MAX_EDITS or self._bytes + size > MAX_EDIT_BYTES:
                self.lost += 1
            else:
                self._waiting.append(sample)
                self._bytes += size
        self._wake()

    def take(self, most: int) -> list[Edit]:
        """The oldest edits not taken yet, so many at most; the loop is woken again where there are more."""
        with self._lock:
            samples = [self._waiting.popleft() for _ in range(min(most, len(self._waiting)))]
            self._bytes -= sum(len(sample.payload) for sample in samples)
            more = bool(self._waiting)
        if more:
            self._wake()
        if self.lost > self._said:
            self._said = self.lost
            bounds = f"{MAX_EDITS} edits or {MAX_EDIT_BYTES} bytes"
            self._report("edits lost", f"{self._key}: {self.lost} edits lost so far: more than {bounds} waited at once")
        return [_edit_of(sample) for sample in samples]


def check_names(parameters: Mapping[str, str], known: Sequence[str]) -> None:
    """Refuse a selector's parameter that is not known: misspelt, it would be answered as if it were not there.

    Every get knows `format`; names that begin with `_` are Zenoh's own. Raises Refused with the parameter's name.
    """
    for name in parameters:
        if name not in known and name != "format" and not name.startswith("_"):
            raise Refused(f"{shown(name[:40])}: unknown parameter; there are {', '.join((*known, 'format'))}")


def key_matches(expression: str, key: str) -> bool:
    """Whether a Zenoh key expression takes in a concrete key, by Zenoh's own rules."""
    return bool(zenoh.KeyExpr(expression).includes(zenoh.KeyExpr(key)))


def _edit_of(sample: zenoh.Sample) -> Edit:
    kind: Literal["put", "delete"] = "put" if sample.kind == zenoh.SampleKind.PUT else "delete"
    return Edit(str(sample.key_expr), kind, sample.payload.to_bytes(), str(sample.encoding))
