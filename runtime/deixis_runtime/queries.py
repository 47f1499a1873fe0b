"""Gets answered and edits heard, both handed to the stage's loop: in a Zenoh callback nothing may block or call Zenoh."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import zenoh
from deixis_schemas import codec
from deixis_schemas.messages import Message

MAX_WAITING = 64
# An edit has no answer that would tell of its loss: a site's worth of POIs in one burst, many times over, is kept.
MAX_EDITS = 10_000
MAX_PAYLOAD_BYTES = 1 << 20


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
    """Gets on one key expression, waiting for the loop."""

    def __init__(self, answer: Answer, wake: Callable[[], None], report: Callable[[str, str], None]) -> None:
        self._answer = answer
        self._wake = wake
        self._report = report
        self._lock = threading.Lock()
        self._waiting: deque[zenoh.Query] = deque()
        self.refused = 0

    def store(self, query: zenoh.Query) -> None:
        """Callback of the Zenoh queryable. Past the bound the oldest is dropped, which the asker sees as no answer."""
        with self._lock:
            if len(self._waiting) >= MAX_WAITING:
                self._waiting.popleft()
                self.refused += 1
            self._waiting.append(query)
        self._wake()

    def pending(self) -> bool:
        """Whether somebody waits."""
        return bool(self._waiting)

    def answer_all(self) -> None:
        """Answer everybody who waits; called from the loop."""
        with self._lock:
            waiting = list(self._waiting)
            self._waiting.clear()
        for query in waiting:
            self._answer_one(query)

    def _answer_one(self, query: zenoh.Query) -> None:
        try:
            try:
                self._reply(query)
            except Refused as error:
                self.refused += 1
                query.reply_err(str(error).encode(), encoding="text/plain")
        except zenoh.ZError as error:
            self._report(f"reply {query.key_expr}", f"{query.key_expr}: cannot reply: {error}")
        finally:
            query.drop()  # type: ignore[no-untyped-call]

    def _reply(self, query: zenoh.Query) -> None:
        parameters = {str(name): str(value) for name, value in dict(query.parameters).items()}  # type: ignore[call-overload]
        wanted = parameters.get("format", "msgpack")
        if wanted not in ("msgpack", "json"):
            raise Refused(f"format: '{wanted[:40]}' is neither 'msgpack' nor 'json'")
        payload = query.payload.to_bytes() if query.payload is not None else None
        if payload is not None and len(payload) > MAX_PAYLOAD_BYTES:
            raise Refused(f"payload: {len(payload)} bytes, more than {MAX_PAYLOAD_BYTES}")
        encoding = str(query.encoding) if query.encoding is not None else ""
        for key, message in self._answer(Query(str(query.key_expr), parameters, payload, encoding)):
            if wanted == "json":
                query.reply(key, codec.encode_json(message), encoding=codec.JSON)
            else:
                query.reply(key, codec.encode(message), encoding=codec.encoding_of(type(message)))


class EditQueue:
    """Puts and deletes on one key expression, waiting for the loop in their order."""

    def __init__(self, wake: Callable[[], None], report: Callable[[str, str], None]) -> None:
        self._wake = wake
        self._report = report
        self._lock = threading.Lock()
        self._waiting: deque[zenoh.Sample] = deque()
        self.lost = 0

    def store(self, sample: zenoh.Sample) -> None:
        """Callback of the Zenoh subscriber. Past the bound the newest is `lost`: an edit already heard is not forgotten."""
        with self._lock:
            if len(self._waiting) >= MAX_EDITS:
                self.lost += 1
            else:
                self._waiting.append(sample)
        self._wake()

    def pending(self) -> bool:
        """Whether there is something to take."""
        return bool(self._waiting)

    def take_all(self) -> list[Edit]:
        """All edits heard since the last call."""
        with self._lock:
            samples = list(self._waiting)
            self._waiting.clear()
        if self.lost:
            self._report("edits", f"{self.lost} edits lost so far: more than {MAX_EDITS} waited at once")
        return [_edit_of(sample) for sample in samples]


def key_matches(expression: str, key: str) -> bool:
    """Whether a Zenoh key expression takes in a concrete key, by Zenoh's own rules."""
    return bool(zenoh.KeyExpr(expression).includes(zenoh.KeyExpr(key)))


def _edit_of(sample: zenoh.Sample) -> Edit:
    kind: Literal["put", "delete"] = "put" if sample.kind == zenoh.SampleKind.PUT else "delete"
    return Edit(str(sample.key_expr), kind, sample.payload.to_bytes(), str(sample.encoding))
