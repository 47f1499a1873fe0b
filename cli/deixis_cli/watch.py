"""`deixis watch`: the answers of a running system as they come, and a line a second on what each stage sees."""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import ExitStack
from typing import Any

import zenoh
from deixis_runtime.session import open_client
from deixis_schemas import topics
from deixis_schemas.messages import Belief, Target

from . import wording
from .gets import get_state
from .inbox import Inbox, Received
from .interrupts import Interrupts
from .options import add_connect, add_json, add_robot
from .recorder import line_of
from .summary import Summary

TURN_S = 0.1
LINE_EVERY_S = 1.0
# No frames: looking on must not pull the pictures over the link.
WATCHED = (topics.CAMERA_INFO, topics.TRACKS, topics.HEAD_POSES, topics.GESTURES, topics.BELIEF, topics.TARGET)


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("watch", help="live answers", description=__doc__)
    add_robot(parser)
    add_connect(parser)
    parser.add_argument("--seconds", type=float, metavar="N", help="stop after so long (default: on Ctrl-C)")
    add_json(parser, "print JSON lines: each target, and a belief a second")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Watch until interrupted: then 0. Raises Unreachable without a router."""
    with ExitStack() as stack:
        interrupts = stack.enter_context(Interrupts())
        session = stack.enter_context(open_client(given.connect, shared_memory=False))
        inbox = Inbox()
        for topic in (*WATCHED, topics.POI):
            key = topic.key(given.robot, **({"id": "*"} if topic is topics.POI else {}))
            stack.callback(session.declare_subscriber(key, inbox.store).undeclare)
        state = get_state(session, given.robot)
        names = {poi.poi_id: poi.name for poi in state.pois} if state else {}
        printer = Printer(Summary(names), as_json=given.json)
        until_s = None if given.seconds is None else time.monotonic() + given.seconds
        _watch(session, inbox, printer, interrupts, until_s)
    return 0


class Printer:
    """Prints targets at once and the rest once a second."""

    def __init__(self, summary: Summary, *, as_json: bool) -> None:
        self._summary = summary
        self._as_json = as_json
        self._due_s = 0.0

    def hear(self, received: Received, now_s: float) -> None:
        """Take in one message, and print what is due."""
        message = received.message
        if message is None:
            return
        self._summary.hear(message)
        due = isinstance(message, Belief) and now_s >= self._due_s
        if due:
            self._due_s = now_s + LINE_EVERY_S
        if isinstance(message, Target):
            self._say(received, wording.target_line(message, self._summary.names))
            if message.final and not self._as_json:
                print(f"  {message.reason}", flush=True)
        elif due:
            self._say(received, self._summary.line())

    def _say(self, received: Received, text: str) -> None:
        print(line_of(received).rstrip("\n") if self._as_json else text, flush=True)


def _watch(session: zenoh.Session, inbox: Inbox, printer: Printer, interrupts: Interrupts, until_s: float | None) -> None:
    linked = True
    silent_since_s: float | None = time.monotonic()
    while not interrupts.requested() and (until_s is None or time.monotonic() < until_s):
        inbox.wait(TURN_S)
        now_s = time.monotonic()
        heard = inbox.take_all()
        for received in heard:
            printer.hear(received, now_s)
        silent_since_s = None if heard else silent_since_s
        if silent_since_s is not None and now_s - silent_since_s > 3.0:
            print("deixis watch: nothing is heard of this robot yet; 'deixis doctor' tells why", file=sys.stderr)
            silent_since_s = None
        if bool(session.info.routers_zid()) != linked:
            linked = not linked
            print(f"deixis watch: the router is {'back' if linked else 'gone; waiting for it'}", file=sys.stderr)
