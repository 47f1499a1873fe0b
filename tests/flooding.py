"""Floods keys: `python tests/flooding.py ENDPOINT puts|gets|garbage|garbage_gets COUNT KEY...`; prints what became of it.

By turns on each of the keys; `{number}` in a key is the number of the put. A process of its own, so that the test that measures
meanwhile is not what is slowed down.
"""

from __future__ import annotations

import itertools
import json
import os
import random
import sys
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import zenoh
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics

IN_FLIGHT = 2048
GET_TIMEOUT_S = 20.0


def command(endpoint: str, what: str, count: int, *keys: str) -> list[str]:
    """The command line of such a process. It gives way to all others."""
    return ["nice", "-n", "5", sys.executable, str(Path(__file__)), endpoint, what, str(count), *keys]


def puts(session: zenoh.Session, count: int, keys: Sequence[str]) -> Counter[str]:
    """Good POIs."""
    for number, key in zip(range(count), itertools.cycle(keys)):
        payload = json.dumps({"position_m": [number % 50, number % 7, 1.0]})
        session.put(key.format(number=number), payload, congestion_control=zenoh.CongestionControl.BLOCK)
    return Counter(sent=count)


def garbage(session: zenoh.Session, count: int, keys: Sequence[str]) -> Counter[str]:
    """What breaks the contract: noise, and halves of good messages, under labels that are right and wrong."""
    for number, key in zip(range(count), itertools.cycle(keys)):
        topic = topics.topic_of(key)
        label = codec.encoding_of(topic.type) if topic is not None and number % 3 else "zenoh/bytes"
        session.put(key, _noise(number), encoding=label, congestion_control=zenoh.CongestionControl.BLOCK)
    return Counter(sent=count)


def _noise(number: int) -> bytes:
    chance = random.Random(number)
    return chance.randbytes(chance.randrange(200))


def garbage_gets(session: zenoh.Session, count: int, keys: Sequence[str]) -> Counter[str]:
    """Gets that bring noise along, and edits that are none."""
    return gets(session, count, keys, _noise)


def gets(
    session: zenoh.Session, count: int, keys: Sequence[str], payload: Callable[[int], bytes | None] = lambda _: None
) -> Counter[str]:
    """How many gets were answered, refused, or ended without either. `payload` is what the get of a number brings along."""
    became, lock, room = Counter[str](), threading.Lock(), threading.Semaphore(IN_FLIGHT)
    for number, key in zip(range(count), itertools.cycle(keys)):
        room.acquire()
        hear, end = _hearing(became, lock, room)
        session.get(key, zenoh.handlers.Callback(hear, end), payload=payload(number), timeout=GET_TIMEOUT_S)
    for _ in range(IN_FLIGHT):
        room.acquire()
    return became


def _hearing(
    became: Counter[str], lock: threading.Lock, room: threading.Semaphore
) -> tuple[Callable[[zenoh.Reply], None], Callable[[], None]]:
    """What is called with each reply to one get, and at its end."""
    heard: list[str] = []

    def hear(reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            heard.append("answered")
        elif reply.err is not None:
            heard.append("timed out" if reply.err.payload.to_string() == "Timeout" else "refused")

    def end() -> None:
        with lock:
            became[heard[0] if heard else "unanswered"] += 1
        room.release()

    return hear, end


def main(argv: Sequence[str]) -> None:
    """Flood, and print what became of it as one JSON document."""
    endpoint, what, count, *keys = argv
    flood = {"puts": puts, "garbage": garbage, "gets": gets, "garbage_gets": garbage_gets}[what]
    with open_client(endpoint, shared_memory=False) as session:
        became = flood(session, int(count), keys)
    print(json.dumps(became), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1:])
