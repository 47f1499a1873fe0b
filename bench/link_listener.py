"""What a host of `link.py` hears of a robot: one line of JSON for each belief, target and health of the camera, as it comes.

usage (on that host): python bench/link_listener.py ROBOT ENDPOINT FILE [--peers ENDPOINT,...] [--frames]
"""

from __future__ import annotations

import argparse
import json
import time
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import zenoh
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import client_config
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame
from deixis_schemas.topics import Topic
from peer_stage import peer_config


def main() -> None:
    """Listen until told to stop."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot")
    parser.add_argument("endpoint", help="the router; with --peers where to listen")
    parser.add_argument("file", type=Path)
    parser.add_argument("--peers", default="")
    parser.add_argument("--frames", action="store_true", help="frames as well: their encoding and bytes")
    given = parser.parse_args()
    config = peer_config(given.endpoint, given.peers.split(",")) if given.peers else client_config(given.endpoint)
    heard: dict[Topic, dict[str, str]] = {topics.BELIEF: {}, topics.TARGET: {}, topics.HEALTH: {"stage": topics.FRAME.stage}}
    if given.frames:
        heard[topics.FRAME] = {}
    with Interrupts() as interrupts, given.file.open("w") as out, zenoh.open(config) as session:
        kept = [
            session.declare_subscriber(topic.key(given.robot, **parts), partial(note, out, topic))
            for topic, parts in heard.items()
        ]
        while not interrupts.wait(0.1):
            out.flush()
        kept.clear()


def note(out: TextIO, topic: Topic, sample: zenoh.Sample) -> None:
    """Zenoh callback: one line."""
    now_ns = time.time_ns()
    message: Any = codec.decode(topic.type, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topic.max_bytes)
    line: dict[str, Any] = {"at_s": now_ns / 1e9, "type": topic.type.__name__, "age_s": (now_ns - message.stamp_ns) / 1e9}
    line |= {"notes": getattr(message, "notes", []), "final": getattr(message, "final", False)}
    line |= {"counters": getattr(message, "counters", {}), "poi_ids": getattr(message, "poi_ids", [])}
    if isinstance(message, Frame):
        line |= {"encoding": message.encoding, "bytes": len(sample.payload)}
    print(json.dumps(line), file=out)


if __name__ == "__main__":
    main()
