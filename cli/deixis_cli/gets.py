"""Questions to a running system: gets, decoded and bounded in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import zenoh
from deixis_runtime.delivery import GET_PRIORITY
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health, Message, Poi, State

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
            good.append((key, _read(type_, key, reply.ok)))
        except codec.CodecError as error:
            bad.append(Refusal(key, str(error)))
    return good, bad


def get_state(session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S) -> State | None:
    """What fusion knows; none where it does not answer."""
    states, _ = get_all(session, topics.STATE.key(robot), State, timeout_s=timeout_s)
    return states[0][1] if states else None


def get_pois(session: zenoh.Session, robot: str, poi_id: str = "**", timeout_s: float = TIMEOUT_S) -> list[Poi] | None:
    """All POIs by id, or the one of this id; none where fusion does not answer.

    No reply comes from an empty registry and from an absent fusion alike, so then its state is asked.
    """
    found, _ = get_all(session, topics.POI.key(robot, id=poi_id), Poi, timeout_s=timeout_s)
    if not found and get_state(session, robot, timeout_s) is None:
        return None
    return sorted((poi for _, poi in found), key=lambda poi: poi.poi_id)


def get_names(session: zenoh.Session, robot: str) -> dict[str, str]:
    """Names of the POIs by id; empty where fusion does not answer."""
    return {poi.poi_id: poi.name for poi in get_pois(session, robot) or []}


def get_healths(session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S) -> list[Health]:
    """The health records of all stages that answer, by stage and instance."""
    healths, _ = get_all(session, topics.HEALTH.key(robot, stage="*"), Health, timeout_s=timeout_s)
    return sorted((health for _, health in healths), key=lambda health: (health.stage, health.instance))


def _read(type_: type[T], key: str, sample: zenoh.Sample) -> T:
    topic = topics.topic_of(key)
    if topic is None:
        raise codec.Malformed("a key outside the contract")
    return codec.decode(type_, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topic.max_bytes)
