"""What rmw_zenoh attaches to each message: its number, when it was sent, and by whom. Pure."""

from __future__ import annotations

import struct
from dataclasses import dataclass

# Zenoh's serialisation: two little-endian int64, then an array with its length as a varint, which is one byte here.
LAYOUT = struct.Struct("<qqB16s")
GLOBAL_ID_BYTES = 16


class BadAttachment(ValueError):
    """Bytes that are no attachment of rmw_zenoh."""


@dataclass(frozen=True)
class Attachment:
    """number: of the message, from 1 by each publisher; source_ns: Unix nanoseconds; global_id: the publisher's 16 bytes."""

    number: int
    source_ns: int
    global_id: bytes

    def encoded(self) -> bytes:
        """As it travels."""
        return LAYOUT.pack(self.number, self.source_ns, GLOBAL_ID_BYTES, self.global_id)

    @staticmethod
    def read(data: bytes) -> Attachment:
        """Raises BadAttachment."""
        if len(data) != LAYOUT.size:
            raise BadAttachment(f"an attachment of {len(data)} bytes instead of {LAYOUT.size}")
        number, source_ns, length, global_id = LAYOUT.unpack(data)
        if length != GLOBAL_ID_BYTES:
            raise BadAttachment(f"an attachment with an id of {length} bytes instead of {GLOBAL_ID_BYTES}")
        return Attachment(number, source_ns, global_id)
