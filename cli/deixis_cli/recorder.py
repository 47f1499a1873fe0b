"""What was published, as JSON lines: key, type, seq, stamp_ns, received_ns, message."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Self, TextIO

from deixis_schemas.messages import Frame, Message

from .inbox import Received

FLUSH_EVERY_NS = 1_000_000_000


class RecorderError(OSError):
    """The file cannot be written; the text names it."""


class Recorder:
    """Writes `NAME.jsonl` in a folder, one line per message published; image bytes are left out."""

    def __init__(self, folder: Path, name: str) -> None:
        """Raises RecorderError where the folder or the file cannot be made."""
        self.path = folder / f"{name}.jsonl"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file: TextIO = self.path.open("w", encoding="utf-8")
        except OSError as error:
            raise self._error(error) from None
        self._flushed_ns = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Raises RecorderError where the last lines cannot be written."""
        try:
            self._file.close()
        except OSError as error:
            raise self._error(error) from None

    def write(self, received: Received) -> None:
        """Append a line. Raises RecorderError, as for a full disk."""
        try:
            self._file.write(line_of(received))
            if received.received_ns - self._flushed_ns >= FLUSH_EVERY_NS:
                self._file.flush()
                self._flushed_ns = received.received_ns
        except OSError as error:
            raise self._error(error) from None

    def _error(self, error: OSError) -> RecorderError:
        return RecorderError(f"--out {self.path}: {error.strerror}")


def line_of(received: Received) -> str:
    """One line with its end. A deleted key has `message` null; binary fields other than images are base64."""
    message = received.message
    head = {
        "key": received.key,
        "type": received.topic.type.__name__,
        "seq": getattr(message, "seq", None),
        "stamp_ns": getattr(message, "stamp_ns", None),
        "received_ns": received.received_ns,
    }
    return f'{json.dumps(head)[:-1]}, "message": {_body(message)}}}\n'


def _body(message: Message | None) -> str:
    if message is None:
        return "null"
    return message.model_dump_json(exclude={"data"} if isinstance(message, Frame) else None)
