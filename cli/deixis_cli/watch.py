"""`deixis watch`: the answers of a running system as they come; on a terminal with live beliefs and how the stages fare."""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import ExitStack
from typing import Any

import zenoh
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import open_client
from deixis_schemas import topics
from deixis_schemas.messages import Belief, Target
from rich.console import Console

from . import wording
from .first_answer import FirstAnswer
from .gets import get_names, get_state
from .inbox import Inbox, Received
from .options import CommandError, add_connect, add_json, add_robot, seconds
from .recorder import line_of
from .summary import Summary
from .watch_screen import WatchScreen

TURN_S = 0.1
LINE_EVERY_S = 1.0
SILENT_S = 3.0
# No frames: looking on must not pull the pictures over the link.
WATCHED = tuple(topic for topic in topics.TOPICS if topic not in (topics.FRAME, topics.STATE, topics.ROBOT_POSE))


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("watch", help="live answers", description=__doc__)
    add_robot(parser)
    add_connect(parser)
    parser.add_argument("--seconds", type=seconds, metavar="N", help="stop after so long (default: on Ctrl-C)")
    parser.add_argument(
        "--until-answer", action="store_true", help="print the first final answer alone, also one given before, and stop"
    )
    parser.add_argument("--expect", metavar="POI_ID", help="with --until-answer: succeed only if it is exactly this POI")
    parser.add_argument("--plain", action="store_true", help="lines alone, as where the output is no terminal")
    add_json(parser, "print JSON lines: each target, and a belief a second")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Watch until interrupted: then 0; with --until-answer 1 when none comes, or another than expected.

    Raises CommandError, or Unreachable without a router.
    """
    if given.expect is not None and not given.until_answer:
        raise CommandError("--expect goes with --until-answer")
    with ExitStack() as stack:
        interrupts = stack.enter_context(Interrupts())
        session = stack.enter_context(open_client(given.connect, shared_memory=False))
        inbox = Inbox()
        for topic in WATCHED:
            key = topic.key(given.robot, stage="*", id="*")
            stack.callback(session.declare_subscriber(key, inbox.store).undeclare)
        watch = Watch(session, inbox, interrupts, None if given.seconds is None else time.monotonic() + given.seconds)
        if given.until_answer:
            return _until_answer(watch, given)
        _show(watch, given)
    return 0


def _show(watch: Watch, given: argparse.Namespace) -> None:
    summary = Summary(get_names(watch.session, given.robot))
    console = Console()
    if given.json or given.plain or not console.is_terminal:
        printer = Printer(summary, as_json=given.json)
        while watch.goes_on():
            for received in watch.turn():
                printer.hear(received, time.monotonic())
        return
    with WatchScreen(console, given.robot, summary) as screen:
        while watch.goes_on():
            for received in watch.turn():
                if received.message is not None:
                    screen.hear(received.message)


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


class Watch:
    """Looks on until interrupted or until its time is over, and says where nothing is to be heard."""

    def __init__(self, session: zenoh.Session, inbox: Inbox, interrupts: Interrupts, until_s: float | None) -> None:
        self.session = session
        self._inbox = inbox
        self._interrupts = interrupts
        self._until_s = until_s
        self._linked = True
        self._silent_since_s: float | None = time.monotonic()

    def goes_on(self) -> bool:
        """Whether to go on."""
        return not self._interrupts.requested() and (self._until_s is None or time.monotonic() < self._until_s)

    def turn(self) -> list[Received]:
        """What came within one turn."""
        self._inbox.wait(TURN_S)
        heard = self._inbox.take_all()
        if heard:
            self._silent_since_s = None
        elif self._silent_since_s is not None and time.monotonic() - self._silent_since_s > SILENT_S:
            print("deixis watch: nothing is heard of this robot yet; 'deixis doctor' tells why", file=sys.stderr)
            self._silent_since_s = None
        if bool(self.session.info.routers_zid()) != self._linked:
            self._linked = not self._linked
            print(f"deixis watch: the router is {'back' if self._linked else 'gone; waiting for it'}", file=sys.stderr)
        return heard


def _until_answer(watch: Watch, given: argparse.Namespace) -> int:
    first = FirstAnswer()
    while first.target is None and watch.goes_on():
        if first.should_ask(time.monotonic()):
            first.hear(get_state(watch.session, given.robot))
        for received in watch.turn():
            first.hear(received.message)
    if first.target is not None:
        names = get_names(watch.session, given.robot)
        print(first.target.model_dump_json() if given.json else wording.answer_text(first.target, names), flush=True)
    problem = first.problem(given.expect)
    if problem:
        print(f"deixis watch: {problem}", file=sys.stderr)
    return 1 if problem else 0
