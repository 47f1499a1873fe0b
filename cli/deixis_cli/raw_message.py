"""What travelled under a key, as it was sent: neither decoded nor checked."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RawMessage:
    """One put, or a delete, which has no payload.

    encoding: the label of the payload, e.g. `application/msgpack;Tracks/2`. received_ns: Unix time at whoever heard it.
    """

    key: str
    encoding: str
    payload: bytes
    received_ns: int
    deleted: bool = False
