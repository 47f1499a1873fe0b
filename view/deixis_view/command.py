"""`deixis view`: what a robot sees and why it answers as it does, in pictures: live, or from a recording.

In a window, as a web page (--web), or into a file to share (--out FILE.rrd). Pictures of people are shown where the site lets
them leave the robot.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import chain
from pathlib import Path
from typing import Any

import zenoh
from deixis_cli.gets import get_all, get_pois, get_state, get_timed_healths
from deixis_cli.mcap_file import McapFileError, McapReader
from deixis_cli.options import CommandError, add_connect, seconds
from deixis_cli.raw_message import RawMessage
from deixis_runtime.clock_offset import estimate
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import open_client
from deixis_runtime.settings import checked_name
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo
from rich.console import Console

from .drawer import Drawer, Painter
from .feed import Feed
from .hearing import hear, keys_of
from .installed import SinkError, check_installed, leave_viewer_to_us, new_sink, sink_for_file
from .options import add_draw_options, draw_options, known_place, scene_of
from .recording import messages, paint_all
from .scene import Scene
from .viewer_process import ViewerError, ViewerProcess, has_display
from .web_page import WebPage

DEFAULT_PORT = 9090
TURN_S = 0.2
ASK_CLOCK_EVERY_S = 10.0
SILENT_S = 3.0
END_S = 3.0
NO_DISPLAY = "there is no display for a window here: --web shows a page instead, --out FILE.rrd writes a file"


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("view", help="see it: live or from a recording, in pictures", description=__doc__)
    parser.add_argument("file", nargs="?", type=Path, metavar="FILE.mcap", help="a recording (default: what runs now)")
    parser.add_argument("--robot", type=checked_name, metavar="NAME", help="robot of a running system")
    add_connect(parser)
    add_draw_options(parser)
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--web", action="store_true", help="serve a page to this machine's browsers, instead of a window")
    how.add_argument("--out", type=Path, metavar="FILE.rrd", help="write a file for Rerun's viewer, instead")
    parser.add_argument("--port", type=_port, default=DEFAULT_PORT, help="of the page (default: %(default)s; 0: a free one)")
    parser.add_argument("--pictures", type=Path, metavar="CLIP", help="the clip of a recording that has no pictures of its own")
    parser.add_argument("--seconds", type=seconds, metavar="N", help="stop after so long (default: on Ctrl-C)")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Draw until Ctrl-C, --seconds, or the window is closed: then 0; a recording into a file until its end. 1 where that is
    damaged, with what came before it drawn.

    A recording that was cut off counts as whole, and is said to be cut off.

    Raises CommandError, or Unreachable without a router.
    """
    _check(given)
    until_s = None if given.seconds is None else time.monotonic() + given.seconds
    known = known_place(given.site)
    try:
        with ExitStack() as stack:
            interrupts = stack.enter_context(Interrupts())
            # First: where nothing can be reached or read, no window opens and no file is begun.
            session = stack.enter_context(open_client(given.connect, shared_memory=False)) if given.file is None else None
            recording = McapReader(given.file) if given.file is not None else None
            raws = _begun(recording, given.pictures) if recording is not None else None
            viewer, sink = stack.enter_context(_sink(given))
            scene = scene_of(known, draw_options(given), live=given.file is None)
            painter = Painter(scene, sink)
            show = Showing(viewer, interrupts, until_s)
            damage = ""
            if recording is not None and raws is not None:
                damage = _recorded(given, recording, raws, painter, show)
            elif session is not None:
                _live(given, session, scene, painter, show)
            if damage and not painter.shots:
                raise CommandError(damage)
            if not sink.close() and given.out is not None:
                raise CommandError(f"'{given.out}' could not be written to its end")
            if given.out is not None:
                _tell_drawn(str(given.file or f"robot {given.robot}"), painter)
                print(f"{given.out}: 'rerun {given.out}' shows it", file=sys.stderr)
    except (ViewerError, McapFileError, SinkError) as error:
        raise CommandError(str(error)) from None
    if painter.left_out:
        print(f"deixis view: {painter.left_out} frames were left out: the viewer did not keep up", file=sys.stderr)
    return 1 if damage else 0


class Showing:
    """Goes on until Ctrl-C, until its time is over, or until the viewer is closed."""

    def __init__(self, viewer: ViewerProcess | None, interrupts: Interrupts, until_s: float | None) -> None:
        self._viewer, self._interrupts, self._until_s = viewer, interrupts, until_s

    @property
    def interrupted(self) -> bool:
        """Whether somebody asked us to stop."""
        return self._interrupts.requested()

    def stopped(self) -> bool:
        """Whether it is over. Raises ViewerError where the viewer has died."""
        if self._viewer is not None and self._viewer.closed():
            if failure := self._viewer.failure():
                raise ViewerError(failure)
            return True
        return self.interrupted or (self._until_s is not None and time.monotonic() > self._until_s)

    def stay(self) -> None:
        """Until it is over."""
        while not self.stopped():
            self._interrupts.wait(TURN_S)


def _check(given: argparse.Namespace) -> None:
    if given.file is None and not given.robot:
        raise CommandError("say which robot (--robot NAME), or a recording (FILE.mcap)")
    if given.file is not None and given.robot:
        raise CommandError(f"--robot {given.robot} goes with a running system: '{given.file}' says itself whose it is")
    if given.file is None and given.pictures is not None:
        raise CommandError("--pictures CLIP goes with a recording")
    if not given.web and given.out is None and not has_display():
        raise CommandError(NO_DISPLAY)
    check_installed()


@contextmanager
def _sink(given: argparse.Namespace) -> Iterator[tuple[ViewerProcess | None, Any]]:
    """Where it is drawn, and the viewer, where there is one. Raises CommandError, ViewerError."""
    name = given.file.stem if given.file is not None else given.robot
    if given.out is not None:
        sink = sink_for_file(given.out, name=name)
        try:
            yield None, sink
        finally:
            sink.discard()
        return
    viewer = ViewerProcess(window=not given.web)
    with ExitStack() as stack:
        # Its port first: where that is taken, no viewer is started and no second is lost.
        page = stack.enter_context(WebPage(given.port, viewer.web_port, viewer.url)) if given.web else None
        leave_viewer_to_us()
        sink = new_sink(name, live=given.file is None)
        stack.enter_context(viewer)
        if page is not None:
            print(f"{page.url} shows it to browsers of this machine (Ctrl-C ends)", flush=True)
        yield viewer, sink.to_viewer(viewer.url)


def _begun(recording: McapReader, clip: Path | None) -> Iterator[RawMessage]:
    """A recording's messages, the first of them read. Raises McapFileError, CommandError where there is none to draw."""
    raws = messages(recording, clip)
    first = next(raws, None)
    if first is None:
        cut = ": it was cut off while it was written" if recording.cut else ""
        raise CommandError(f"'{recording.path}' holds no message{cut}")
    return chain((first,), raws)


def _recorded(
    given: argparse.Namespace, recording: McapReader, raws: Iterator[RawMessage], painter: Painter, show: Showing
) -> str:
    """Draw a recording, and stay with its viewer; what is damaged in it, with what came before drawn.

    Raises CommandError, ViewerError.
    """
    damage = ""
    with Console(stderr=True).status(f"drawing {given.file}"):
        try:
            paint_all(raws, painter.take, show.stopped)
        except McapFileError as error:
            damage = str(error)
    if damage:
        print(f"deixis view: {damage}; what comes before that is drawn", file=sys.stderr)
    if recording.cut:
        print(f"deixis view: {recording.cut_off}", file=sys.stderr)
    if given.out is None:
        _tell_drawn(str(given.file), painter)
        show.stay()
    return damage


def _tell_drawn(what: str, painter: Painter) -> None:
    print(f"{what}: {painter.shots} times drawn", file=sys.stderr, flush=True)


def _live(given: argparse.Namespace, session: zenoh.Session, scene: Scene, painter: Painter, show: Showing) -> None:
    """Draw what runs. Raises ViewerError, and CommandError where drawing fails or nothing was heard."""
    feed = Feed()
    _ask(session, given.robot, scene)
    with Drawer(feed, painter, END_S) as drawer, hear(session, keys_of(given.robot, pictures=not given.no_pictures), feed):
        teller = _Teller(given, scene, session)
        asked_s = 0.0
        while not show.stopped() and not drawer.failure:
            time.sleep(TURN_S)
            teller.tell()
            if time.monotonic() - asked_s > ASK_CLOCK_EVERY_S:
                asked_s = time.monotonic()
                _compare_clocks(session, given.robot, scene)
    if drawer.failure:
        raise CommandError(f"drawing has failed: {drawer.failure}")
    if not scene.heard_anything and not (show.interrupted and teller.young):
        raise CommandError(f"nothing was heard of robot '{given.robot}' at {given.connect}; see 'deixis doctor'")


class _Teller:
    """Says on standard error what is missing, once."""

    def __init__(self, given: argparse.Namespace, scene: Scene, session: zenoh.Session) -> None:
        self._given, self._scene, self._session = given, scene, session
        self._linked = True
        self._since_s = time.monotonic()
        self._told: set[str] = set()

    @property
    def young(self) -> bool:
        """Whether it looks on for so short that silence says nothing yet."""
        return time.monotonic() - self._since_s < SILENT_S

    def tell(self) -> None:
        """Say what is missing, once it has been for a while; and each time that the router is gone or back."""
        if bool(self._session.info.routers_zid()) != self._linked:
            self._linked = not self._linked
            print(
                f"deixis view: the router is {'back' if self._linked else 'gone; waiting for it'}", file=sys.stderr, flush=True
            )
        if self.young:
            return
        if not self._scene.heard_anything:
            self._say(f"nothing is heard of robot '{self._given.robot}' at {self._given.connect} yet; see 'deixis doctor'")
        elif not self._given.no_pictures and (why := self._scene.why_no_pictures(time.time_ns())):
            self._say(f"all is shown but pictures: {why}")

    def _say(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            print(f"deixis view: {text}", file=sys.stderr, flush=True)


def _ask(session: zenoh.Session, robot: str, scene: Scene) -> None:
    """What was said before we listened: the lens, the POIs, where the robot stands."""
    now_ns = time.time_ns()
    known = scene.known
    cameras, _ = get_all(session, topics.CAMERA_INFO.key(robot), CameraInfo)
    for key, info in cameras:
        known.hear(key, info, now_ns)
    for poi in get_pois(session, robot) or []:
        known.hear(topics.POI.key(robot, id=poi.poi_id), poi, now_ns)
    state = get_state(session, robot, rows=1)
    if state is not None and state.robot_pose is not None:
        known.hear(topics.ROBOT_POSE.key(robot), state.robot_pose, now_ns)
    if state is not None and state.recent_targets:
        known.hear(topics.TARGET.key(robot), state.recent_targets[-1], now_ns)


def _compare_clocks(session: zenoh.Session, robot: str, scene: Scene) -> None:
    """How far the clock of the camera's host is ahead of ours; what was known stays where it does not answer."""
    found, _ = get_timed_healths(session, robot)
    exchanges = [timed.exchange for (stage, _), timed in found.items() if stage == topics.FRAME.stage]
    offset = estimate(exchanges)
    if offset is not None:
        scene.camera_ahead_ns = offset.beside(time.time_ns() - time.monotonic_ns()).ahead_ns


def _port(text: str) -> int:
    if not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port")
    return int(text)
