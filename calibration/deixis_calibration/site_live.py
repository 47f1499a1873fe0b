"""The guided session at a running system: asks on the terminal, listens by Zenoh; usable over ssh."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from deixis_cli.gets import get_raw
from deixis_cli.inbox import Inbox
from deixis_cli.mcap_file import McapRecorder
from deixis_cli.options import CommandError
from deixis_cli.raw_message import RawMessage
from deixis_runtime.session import open_client
from deixis_runtime.site import Site
from deixis_schemas import topics
from deixis_schemas.messages import Gestures
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from .site_guide import Asked, HoldWatch, plan, somebody_points
from .site_labels import Labelled, Labels
from .site_session import Heard

LISTENED = (topics.TRACKS, topics.HEAD_POSES, topics.GESTURES, topics.ROBOT_POSE, topics.CAMERA_INFO)
TURN_S = 0.1
LOWER_S = 4.0
SILENT_S = 5.0
BELL = "\a"
THANKS = "  thank you: lower the hand"
COUNTS = "what was pointed at until now counts"
NOTHING = "nobody has pointed at anything yet, and nothing is kept"
NOT_HELD = "  no pointing was held; what fusion made of these seconds counts"


@dataclass(frozen=True)
class Session:
    """What is asked. spots: in the map, by name. keep: file that the messages are recorded in, for another `--from`."""

    robot: str
    connect: str
    site: Site
    labels: Labels
    poi_ids: Sequence[str]
    rounds: int
    keep: Path | None


def guide(session: Session, console: Console) -> tuple[Heard, Labels, bool]:
    """Ask for all pointings; the messages, the labels and whether it was ended early (Ctrl-C, end of input).

    Raises CommandError, Unreachable or McapFileError.
    """
    names = {poi.poi_id: poi.name or poi.poi_id for poi in session.site.pois}
    asked = list(plan(list(session.labels.spots), session.poi_ids, session.rounds))
    labelled: list[Labelled] = []
    early = False
    with ExitStack() as stack:
        listener = Listener(stack, session, labelled)
        columns = TextColumn("pointings"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        progress = stack.enter_context(Progress(*columns, console=console))
        task = progress.add_task("", total=len(asked))
        try:
            for one in asked:
                _come(one, session, progress)
                held, label = _ask(one, names, listener, progress)
                labelled += [label] if label is not None else []
                progress.advance(task)
                console.print(THANKS if held else NOT_HELD)
                _lower(listener)
        except (KeyboardInterrupt, EOFError):
            console.print(f"ended early: {COUNTS if labelled else NOTHING}")
            early = True
    return listener.heard, session.labels.model_copy(update={"pointings": labelled}), early


class Listener:
    """Takes in what comes while a pointing is asked for, and nothing in between."""

    def __init__(self, stack: ExitStack, session: Session, labelled: Sequence[Labelled]) -> None:
        """`labelled` is filled meanwhile: without any in the end, nothing is kept."""
        zenoh_session = stack.enter_context(open_client(session.connect, shared_memory=False))
        self._inbox = Inbox()
        self._recorder = stack.enter_context(_kept(session.keep, labelled)) if session.keep is not None else None
        self.heard = Heard()
        self._subscribers = [
            zenoh_session.declare_subscriber(topic.key(session.robot), self._inbox.store) for topic in LISTENED
        ]
        for raw in get_raw(zenoh_session, topics.CAMERA_INFO.key(session.robot)):
            self._take(raw)
        if self.heard.camera is None:
            raise CommandError(
                f"no camera of robot '{session.robot}' tells its lens: is the system running? Ask 'deixis doctor'"
            )

    def drop(self) -> None:
        """Forget what waits: nobody was asked to point."""
        for _ in self._inbox.take_raw():
            pass

    def gestures(self) -> list[Gestures]:
        """What came within a turn; the gestures of it. Raises McapFileError."""
        self._inbox.wait(TURN_S)
        return [message for raw in self._inbox.take_raw() if isinstance(message := self._take(raw), Gestures)]

    def _take(self, raw: RawMessage) -> object:
        received = self._inbox.read(raw)
        if received is None or received.message is None:
            return None
        if self._recorder is not None:
            self._recorder.write(raw)
        self.heard.hear(received.message)
        return received.message

    def seconds(self, stamp_ns: int) -> float:
        """Since the first frame that was taken in."""
        frames = self.heard.tracked()
        return max(0.0, (stamp_ns - frames[0].source.stamp_ns) / 1e9) if frames else 0.0


@contextmanager
def _kept(path: Path, labelled: Sequence[Labelled]) -> Iterator[McapRecorder]:
    """Record there; what holds no pointing is taken away again, with the folders made for it: the next try needs the name."""
    new_folders = [folder for folder in path.parents if not folder.exists()]
    recorder = McapRecorder(path)
    try:
        with recorder:
            yield recorder
    finally:
        if not labelled:
            path.unlink()
            for folder in new_folders:
                folder.rmdir()


def _come(one: Asked, session: Session, progress: Progress) -> None:
    """Have the person walk to the spot. Raises EOFError or KeyboardInterrupt."""
    if one.first_at_spot:
        x, y = session.labels.spots[one.spot]
        where = f"spot {one.spot} (map {x:.2f}, {y:.2f}), facing the robot"
        _pause(progress, f"Stand at {where}. Enter when somebody stands there: ")


def _ask(one: Asked, names: dict[str, str], listener: Listener, progress: Progress) -> tuple[bool, Labelled | None]:
    """Have the person point. Whether that was held, and when it was; none where nothing was seen meanwhile."""
    progress.console.print(f"{BELL}Point at [bold]{one.poi_id}[/bold], {names[one.poi_id]}, look at it, and hold.")
    listener.drop()
    watch = HoldWatch()
    held = _wait(listener, watch.hear, {"held", "given up"}) == "held"
    from_s, to_s = (listener.seconds(stamp_ns) for stamp_ns in watch.span_ns)
    return held, Labelled(poi_id=one.poi_id, spot=one.spot, from_s=from_s, to_s=to_s) if to_s > from_s else None


def _lower(listener: Listener) -> None:
    """Until nobody points, for a few seconds at most."""
    end_s = time.monotonic() + LOWER_S
    while time.monotonic() < end_s and (not (come := listener.gestures()) or somebody_points(come[-1])):
        pass


def _wait(listener: Listener, hear: Callable[[Gestures], str], ends: set[str]) -> str:
    """Raises CommandError where the gesture stage is silent."""
    last_s = time.monotonic()
    while True:
        for gestures in listener.gestures():
            last_s = time.monotonic()
            state = hear(gestures)
            if state in ends:
                return state
        if time.monotonic() - last_s > SILENT_S:
            raise CommandError("no gestures are heard: is the gesture stage running? ('deixis status')")


def _pause(progress: Progress, text: str) -> None:
    """Wait for Enter; the bar stands still meanwhile. Raises EOFError or KeyboardInterrupt."""
    progress.stop()
    try:
        print(text, end="", file=sys.stderr, flush=True)
        if not sys.stdin.readline():
            raise EOFError
    finally:
        progress.start()
