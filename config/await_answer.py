"""The one-shot service `demo`: prints the first final answer of a robot. Usage: await_answer.py ROBOT POI_ID

Exits 0 only if the answer is that one POI; 1 for another answer, or when none comes in time.
"""

from __future__ import annotations

import sys
import threading
import time

import zenoh
from deixis_runtime.session import Unreachable, exit_now, open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import State, Target

ENDPOINT = "unixsock-stream//run/deixis/router.sock"
PATIENCE_S = 120.0
ASK_EVERY_S = 2.0


def first_answer(session: zenoh.Session, robot: str) -> Target | None:
    """The first final target, heard or (where it came before us) asked for; None when there is none in time."""
    heard: list[Target] = []
    arrived = threading.Event()

    def hear(sample: zenoh.Sample) -> None:
        try:
            target = codec.decode(Target, sample.payload.to_bytes(), str(sample.encoding))
        except codec.CodecError as error:
            print(f"{sample.key_expr}: {error}", file=sys.stderr)
            return
        if target.final:
            heard.append(target)
            arrived.set()

    subscriber = session.declare_subscriber(topics.TARGET.key(robot), hear)
    deadline = time.monotonic() + PATIENCE_S
    while not arrived.wait(ASK_EVERY_S) and time.monotonic() < deadline:
        heard += past_answers(session, robot)
        if heard:
            break
    subscriber.undeclare()  # type: ignore[no-untyped-call]
    return heard[0] if heard else None


def past_answers(session: zenoh.Session, robot: str) -> list[Target]:
    """The final targets that fusion remembers, oldest first."""
    for reply in session.get(topics.STATE.key(robot), timeout=ASK_EVERY_S):
        if reply.ok is not None:
            return codec.decode(State, reply.ok.payload.to_bytes(), str(reply.ok.encoding)).recent_targets
    return []


def main() -> None:
    """Wait, print, and judge."""
    robot, expected = sys.argv[1:3]
    try:
        with open_client(ENDPOINT, shared_memory=False) as session:
            target = first_answer(session, robot)
        problem = judge(target, expected)
    except (Unreachable, codec.CodecError) as error:
        problem = str(error)
    if problem:
        print(f"demo: {problem}", file=sys.stderr)
    exit_now(1 if problem else 0)


def judge(target: Target | None, expected: str) -> str:
    """Print the answer; returns what is wrong with it, empty if nothing."""
    if target is None:
        return f"no final answer within {PATIENCE_S:.0f} s"
    belief = {poi.poi_id: poi.belief for poi in target.pois}
    standing = ", ".join(f"{poi_id} (belief {belief.get(poi_id, 0.0):.3f})" for poi_id in target.poi_ids)
    print(f"Person {target.person_id} points at: {standing or 'no POI'}, conflict {target.conflict:.3f}\n{target.reason}")
    return "" if target.poi_ids == [expected] else f"expected {expected}"


if __name__ == "__main__":
    main()
