"""Questions to a running system: gets, decoded and bounded in time."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

import zenoh
from deixis_runtime.clock_offset import Exchange
from deixis_runtime.delivery import GET_PRIORITY
from deixis_schemas import codec, topics
from deixis_schemas.messages import MAX_POIS, Health, Message, Poi, State

from .raw_message import RawMessage

T = TypeVar("T", bound=Message)

TIMEOUT_S = 1.5
# Zenoh's own error reply for somebody who should have answered and did not.
TIMED_OUT = b"Timeout"


@dataclass(frozen=True)
class Refusal:
    """An error reply, or one that breaks the contract."""

    key: str
    reason: str


@dataclass(frozen=True)
class TimedHealth:
    """A health record, and when it was asked for and came: its stamp is the other host's clock in between."""

    health: Health
    exchange: Exchange


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
    good: list[tuple[str, T]] = []
    bad: list[Refusal] = []
    for reply in _replies(session, selector, payload=payload, encoding=encoding, timeout_s=timeout_s):
        taken = _taken(reply, selector, type_)
        if isinstance(taken, Refusal):
            bad.append(taken)
        elif taken is not None:
            good.append(taken)
    return good, bad


def get_raw(session: zenoh.Session, selector: str, timeout_s: float = TIMEOUT_S) -> list[RawMessage]:
    """The replies to a get as they were sent. Error replies and silence are left out."""
    sent = [reply.ok for reply in _replies(session, selector, timeout_s=timeout_s) if reply.ok is not None]
    return [RawMessage(str(s.key_expr), str(s.encoding), s.payload.to_bytes(), time.time_ns()) for s in sent]


def get_state(session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S, *, rows: int | None = None) -> State | None:
    """What fusion knows, with the first so many `rows` of its lists; none where it does not answer."""
    selector = topics.STATE.key(robot) + ("" if rows is None else f"?top={rows}")
    states, _ = get_all(session, selector, State, timeout_s=timeout_s)
    return states[0][1] if states else None


def get_pois(session: zenoh.Session, robot: str, poi_id: str = "**", timeout_s: float = TIMEOUT_S) -> list[Poi] | None:
    """All POIs by id, or the one of this id; none where fusion does not answer.

    No reply comes from an empty registry and from an absent fusion alike, so then its state is asked. That also names the
    POIs, up to MAX_POIS, for viewers: access control denies them gets on POIs, which may be edits.
    """
    found, _ = get_all(session, topics.POI.key(robot, id=poi_id), Poi, timeout_s=timeout_s)
    if not found:
        state = get_state(session, robot, timeout_s, rows=MAX_POIS)
        return None if state is None else [poi for poi in state.pois if poi_id in ("**", poi.poi_id)]
    return sorted((poi for _, poi in found), key=lambda poi: poi.poi_id)


def get_names(session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S) -> dict[str, str]:
    """Names of the POIs by id; empty where fusion does not answer."""
    return {poi.poi_id: poi.name for poi in get_pois(session, robot, timeout_s=timeout_s) or []}


def get_healths(session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S) -> list[Health]:
    """The health records of all stages that answer, by stage and instance."""
    found, _ = get_timed_healths(session, robot, timeout_s)
    return [timed.health for _, timed in sorted(found.items())]


def get_timed_healths(
    session: zenoh.Session, robot: str, timeout_s: float = TIMEOUT_S
) -> tuple[dict[tuple[str, str], TimedHealth], list[Refusal]]:
    """The health records of all that answer, by (stage, instance), each with the times of asking and answer; and refusals."""
    asked_ns = time.monotonic_ns()
    key = topics.HEALTH.key(robot, stage="*")
    good: dict[tuple[str, str], TimedHealth] = {}
    bad: list[Refusal] = []
    for reply in _replies(session, key, timeout_s=timeout_s):
        returned_ns = time.monotonic_ns()
        health = _taken(reply, key, Health)
        if isinstance(health, Refusal):
            bad.append(health)
        elif health is not None:
            message = health[1]
            between = Exchange(asked_ns, message.stamp_ns, returned_ns)
            good[message.stage, message.instance] = TimedHealth(message, between)
    return good, bad


def _replies(
    session: zenoh.Session, selector: str, *, payload: bytes | None = None, encoding: str | None = None, timeout_s: float
) -> Iterator[zenoh.Reply]:
    """Replies as they come, until all who were asked have answered or the time is over."""
    yield from session.get(
        selector,
        payload=payload,
        encoding=encoding,
        timeout=timeout_s,
        priority=GET_PRIORITY,
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
    )


def _taken(reply: zenoh.Reply, selector: str, type_: type[T]) -> tuple[str, T] | Refusal | None:
    """The message of a reply with its key, or why there is none; None for silence."""
    if reply.ok is None:
        error = reply.err.payload.to_bytes() if reply.err else b""
        return None if error == TIMED_OUT else Refusal(selector, error.decode("utf-8", "replace"))
    key = str(reply.ok.key_expr)
    try:
        return key, _read(type_, key, reply.ok)
    except codec.CodecError as error:
        return Refusal(key, str(error))


def _read(type_: type[T], key: str, sample: zenoh.Sample) -> T:
    topic = topics.topic_of(key)
    if topic is None:
        raise codec.Malformed("a key outside the contract")
    return codec.decode(type_, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topic.max_bytes)
