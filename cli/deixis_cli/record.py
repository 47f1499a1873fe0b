"""`deixis record`: all that a robot's stages publish, into an MCAP file, until told to stop."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import zenoh
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import open_client
from deixis_schemas import topics
from deixis_schemas.topics import Delivery
from rich.console import Console
from rich.status import Status

from .gets import get_raw
from .inbox import Inbox
from .mcap_file import McapFileError, McapRecorder
from .options import CommandError, add_connect, add_robot, seconds
from .raw_message import RawMessage
from .shown import show_by_all

TURN_S = 0.1
SILENT_S = 3.0
NO_FRAMES = "no frames were heard: the camera sends none, or access control keeps them from us"
# What was said once, before we listened: the lens, and the points of interest.
ASKED = (topics.CAMERA_INFO, topics.POI)


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("record", help="what is published, into an MCAP file", description=__doc__)
    parser.add_argument("file", type=Path, metavar="FILE.mcap", help="the recording; must not exist yet")
    add_robot(parser)
    add_connect(parser)
    parser.add_argument("--no-pictures", action="store_true", help="leave out the frames: small, and shows nobody")
    parser.add_argument("--site", type=Path, metavar="FILE", help="site file: its walls are drawn for those who look at it")
    parser.add_argument("--plain", action="store_true", help="what was sent alone, and nothing drawn for Foxglove")
    parser.add_argument("--seconds", type=seconds, metavar="N", help="stop after so long (default: on Ctrl-C)")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Record until Ctrl-C, SIGTERM or --seconds: then 0; 1 where nothing was heard.

    Raises CommandError for a file that exists or cannot be written, Unreachable without a router.
    """
    if given.file.exists():
        raise CommandError(f"'{given.file}' exists already; a recording is never written over")
    until_s = None if given.seconds is None else time.monotonic() + given.seconds
    show = None if given.plain else show_by_all(given.site)
    console = Console(stderr=True)
    with ExitStack() as stack:
        interrupts = stack.enter_context(Interrupts())
        session = stack.enter_context(open_client(given.connect, shared_memory=False))
        inbox = Inbox()
        for key in recorded_keys(given.robot, pictures=not given.no_pictures):
            stack.callback(session.declare_subscriber(key, inbox.store).undeclare)
        try:
            with McapRecorder(given.file, show) as recorder, console.status("recording") as status:
                heard = Recording(given.robot, given.connect, recorder, inbox, status, pictures=not given.no_pictures)
                heard.record(session, interrupts, until_s)
        except McapFileError as error:
            kept = "; what was written until then is kept, and can be replayed" if given.file.exists() else ""
            raise CommandError(f"{error}{kept}") from None
    print(heard.summary(), file=sys.stderr)
    if not heard.counts:
        given.file.unlink()  # a recording of nothing would only be found again
        return 1
    return 0


def recorded_keys(robot: str, *, pictures: bool) -> list[str]:
    """Key expressions of all that is published in the contract, with or without the frames. No two have a key in common."""
    published = [topic for topic in topics.TOPICS if topic.delivery is not Delivery.REPLY]
    wanted = [topic for topic in published if pictures or topic.delivery is not Delivery.BULK_NEWEST]
    return [topic.key(robot, stage="*", id="*") for topic in wanted]


class Recording:
    """Takes what comes from the inbox to the file, and counts it by topic."""

    def __init__(
        self, robot: str, endpoint: str, recorder: McapRecorder, inbox: Inbox, status: Status, *, pictures: bool
    ) -> None:
        """`pictures`: whether frames are to be heard."""
        self.counts: Counter[str] = Counter()
        self._robot = robot
        self._endpoint = endpoint
        self._recorder = recorder
        self._inbox = inbox
        self._status = status
        self._pictures = pictures
        self._began_s = time.monotonic()
        self._bytes = 0
        self._told_silent = False

    def record(self, session: zenoh.Session, interrupts: Interrupts, until_s: float | None) -> None:
        """Until interrupted, or `until_s` by the monotonic clock. Raises McapFileError."""
        for topic in ASKED:
            for reply in get_raw(session, topic.key(self._robot, id="*")):
                self._keep(reply)
        while not interrupts.requested() and (until_s is None or time.monotonic() < until_s):
            self._inbox.wait(TURN_S)
            for message in self._inbox.take_raw():
                self._keep(message)
            self._tell(linked=bool(session.info.routers_zid()))

    def summary(self) -> str:
        """What the file holds, in words."""
        if not self.counts:
            return f"deixis record: nothing was heard of robot '{self._robot}' at {self._endpoint}; see 'deixis status'"
        parts = ", ".join(f"{path} {count}" for path, count in sorted(self.counts.items()))
        lost = f"; {self._inbox.lost} messages lost: this machine or the disk is too slow" if self._inbox.lost else ""
        blind = "" if self.counts[topics.FRAME.path] or not self._pictures else f"; {NO_FRAMES}"
        return f"{self._recorder.path}: {self._size()} in {time.monotonic() - self._began_s:.1f} s ({parts}){lost}{blind}"

    def _keep(self, message: RawMessage) -> None:
        self._recorder.write(message)
        topic = topics.topic_of(message.key)
        self.counts[topic.path.removeprefix("{stage}/") if topic else message.key] += 1
        self._bytes += len(message.payload)

    def _tell(self, *, linked: bool) -> None:
        passed_s = time.monotonic() - self._began_s
        if not self.counts and passed_s > SILENT_S and not self._told_silent:
            self._told_silent = True
            text = f"deixis record: nothing is heard of robot '{self._robot}' at {self._endpoint}; is the name right?"
            print(text, file=sys.stderr)
        link = "" if linked else f" [no link to the router at {self._endpoint}]"
        frames = self.counts[topics.FRAME.path]
        self._status.update(f"recording {self._robot}: {passed_s:.0f} s, {frames} frames, {self._size()}{link} (Ctrl-C ends)")

    def _size(self) -> str:
        return f"{self._bytes / 1e6:.1f} MB"
