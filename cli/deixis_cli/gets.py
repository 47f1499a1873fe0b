"""Questions to a running system: gets, decoded and bounded in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import zenoh
from deixis_runtime.delivery import GET_PRIORITY
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health, Message, State

T = TypeVar("T", bound=Message)

TIMEOUT_S = 1.5
# Zenoh's own error reply for somebody who should have answered and did not.
TIMED_OUT = b"Timeout"


@dataclass(frozen=True)
class Refusal:
    """An error reply, or one that breaks the contract."""

    key: str
    reason: str


def get_all(
    session: zenoh.Session,
    selector: str,
    type_: type[T],
    *,
    payload: bytes | None = None,
    encoding: str | None = None,
    timeout_s: float = TIMEOUT_S,
) -> tuple[list[tuple[str, T]], list[Refusal]]:
    """All replies to a get: the messages with their keys, and the refusals. Silence is neither."""
    replies = session.get(
        selector,
        payload=payload,
        encoding=encoding,
        timeout=timeout_s,
        priority=GET_PRIORITY,
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
    )
    good: list[tuple[str, T]] = []
    bad: list[Refusal] = []
    for reply in replies:
        if reply.ok is None:
            error = reply.err.payload.to_bytes() if reply.err else b""
            if error != TIMED_OUT:
                bad.append(Refusal(selector, error.decode("utf-8", "replace")))
            continue
        key = str(reply.ok.key_expr)
        try:
            good.append((key, codec.decode(type_, reply.ok.payload.to_bytes(), str(reply.ok.encoding))))
        except codec.CodecError as error:
            bad.append(Refusal(key, str(error)))
    return good, bad


def get_state(session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S) -> State | None:
    """What fusion knows; none where it does not answer."""
    states, _ = get_all(session, topics.STATE.key(robot), State, timeout_s=timeout_s)
    return states[0][1] if states else None


def get_healths(session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S) -> list[Health]:
    """The health records of all stages that answer, by stage and instance."""
    healths, _ = get_all(session, topics.HEALTH.key(robot, stage="*"), Health, timeout_s=timeout_s)
    return sorted((health for _, health in healths), key=lambda health: (health.stage, health.instance))
