"""Recordings as MCAP files (mcap.dev): each payload as it was sent, beside the JSON Schema of its type.

MCAP is what robot tools read and write (Foxglove, Rerun, `mcap` of the command line). A channel is a key and a label of the
payload; its message encoding is `msgpack`, or `json` as generic clients put POIs. A delete is an empty message on a channel
whose metadata say `deleted`. Channels whose metadata say `shown` are for such tools alone, and are not read here.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Self

import zstandard
from deixis_schemas import codec, topics
from deixis_schemas.export import json_schema

# mcap (Foxglove's own, MIT): the reference implementation for Python, without dependencies but its two compressors.
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Message
from mcap.stream_reader import CRCValidationError, StreamReader
from mcap.writer import CompressionType, Writer

from .raw_message import RawMessage
from .shown import Show, Shown

LABEL, DELETED, SHOWN = "encoding", "deleted", "shown"
# A chunk is what a process that is killed loses; frames fill one each, all else about a second's messages.
CHUNK_BYTES = 256 << 10
MAX_RECORD_BYTES = 256 << 20
"""Of a record in a file that is read; the largest frame that the contract allows is half of it."""
# What the library raises besides its own errors on bytes that are no MCAP.
DAMAGED = (McapError, CRCValidationError, struct.error, zstandard.ZstdError, ValueError, KeyError, RuntimeError)


class McapFileError(OSError):
    """A recording that cannot be written or read; the text names the file."""


class McapRecorder:
    """Writes a recording. Use as a context manager: what is missing at the end of a file makes it slow to open elsewhere."""

    def __init__(self, path: Path, show: Show | None = None) -> None:
        """`show` makes what other programs show. Raises McapFileError where the file is there already or cannot be made."""
        self.path = path
        self.messages = 0
        self._show = show
        self._channels: dict[tuple[str, str, bool], int] = {}
        self._shown: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[bytes] = path.open("xb")
            # lz4: pictures hardly become smaller, and it takes the least time with them.
            self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.LZ4)
            self._writer.start(profile="", library="deixis")
        except FileExistsError:
            raise McapFileError(f"'{path}' exists already; a recording is never written over") from None
        except OSError as error:
            raise _failed(path, error) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Raises McapFileError where the end cannot be written."""
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise _failed(self.path, error) from None
        finally:
            self._close()

    def write(self, message: RawMessage) -> None:
        """Append a message. Raises McapFileError, as for a full disk."""
        try:
            channel = self._channel(message)
            self._writer.add_message(
                channel, message.received_ns, message.payload, message.received_ns, self.messages & 0xFFFFFFFF
            )
            for shown in self._show(message) if self._show is not None else []:
                self._writer.add_message(self._shown_channel(shown), message.received_ns, shown.payload, message.received_ns)
        except OSError as error:
            raise _failed(self.path, error) from None
        self.messages += 1

    def _channel(self, message: RawMessage) -> int:
        name = (message.key, message.encoding, message.deleted)
        if name not in self._channels:
            metadata = {DELETED: "true"} if message.deleted else {LABEL: message.encoding}
            kind = "" if message.deleted else _message_encoding(message.encoding)
            self._channels[name] = self._writer.register_channel(message.key, kind, self._schema(message), metadata)
        return self._channels[name]

    def _shown_channel(self, shown: Shown) -> int:
        name = (shown.topic, shown.schema)
        if name not in self._shown:
            if shown.schema not in self._schemas:
                registered = self._writer.register_schema(shown.schema, shown.schema_encoding, shown.schema_data)
                self._schemas[shown.schema] = registered
            schema = self._schemas[shown.schema]
            self._shown[name] = self._writer.register_channel(shown.topic, shown.encoding, schema, {SHOWN: "true"})
        return self._shown[name]

    def _schema(self, message: RawMessage) -> int:
        """The type that the key carries; 0, which is none, for a key outside the contract and for a delete."""
        topic = topics.topic_of(message.key)
        if topic is None or message.deleted:
            return 0
        name = f"{topic.type.__name__}/{topic.version}"
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, "jsonschema", json_schema(topic.type))
        return self._schemas[name]

    def _close(self) -> None:
        try:
            self._file.close()
        except OSError as error:
            raise _failed(self.path, error) from None


class McapReader:
    """The messages of a recording, in the order in which they were heard. Iterate once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.cut = False
        """Whether the file ended before its end, as after a kill or a full disk; known when all has been read."""

    @property
    def cut_off(self) -> str:
        """One line for people where it was; known when all has been read."""
        return f"'{self.path}' was cut off while it was written; what it holds is used" if self.cut else ""

    def __iter__(self) -> Iterator[RawMessage]:
        """Raises McapFileError for a file that is missing or no recording; one that is cut gives what it holds."""
        try:
            with self.path.open("rb") as file:
                yield from self._messages(file)
        except OSError as error:
            raise _failed(self.path, error) from None

    def _messages(self, file: IO[bytes]) -> Iterator[RawMessage]:
        channels: dict[int, Channel] = {}
        records = iter(StreamReader(file, validate_crcs=True, record_size_limit=MAX_RECORD_BYTES).records)
        any_read = False
        while True:
            try:
                record: Any = next(records, None)
            except DAMAGED as error:
                # Of a record that is cut the library says now this, now that.
                self.cut = any_read and not file.read(1)
                if self.cut:
                    return
                what = "is damaged" if any_read else "is no MCAP file, or damaged"
                raise McapFileError(f"'{self.path}' {what}: {' '.join(str(error).split())[:200] or 'it is empty'}") from None
            if record is None:
                return
            any_read = True
            if isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                channel = channels.get(record.channel_id)
                if channel is None:
                    gone = f"a message of channel {record.channel_id}, which it does not have"
                    raise McapFileError(f"'{self.path}' is damaged: {gone}")
                if SHOWN not in channel.metadata:
                    yield self._raw(channel, record)

    def _raw(self, channel: Channel, record: Message) -> RawMessage:
        label, deleted = channel.metadata.get(LABEL, ""), DELETED in channel.metadata
        return RawMessage(channel.topic, label, record.data, record.log_time, deleted)


def keys_in(path: Path) -> set[str]:
    """The keys that a recording has messages of. Raises McapFileError.

    From the summary at the end of the file; one that was cut has none, and is read through.
    """
    try:
        with path.open("rb") as file:
            summary = SeekingReader(file, record_size_limit=MAX_RECORD_BYTES).get_summary()
            if summary is not None:
                return {channel.topic for channel in summary.channels.values() if SHOWN not in channel.metadata}
    except DAMAGED:
        pass  # reading it through says what is wrong
    except OSError as error:
        raise _failed(path, error) from None
    return {message.key for message in McapReader(path)}


def _message_encoding(label: str) -> str:
    """MCAP's word for a payload's encoding; empty, which is none, for what it has no word for."""
    media_type = label.split(";", maxsplit=1)[0]
    return {codec.MSGPACK: "msgpack", codec.JSON: "json"}.get(media_type, "")


def _failed(path: Path, error: OSError) -> McapFileError:
    return error if isinstance(error, McapFileError) else McapFileError(f"'{path}': {error.strerror or error}")
