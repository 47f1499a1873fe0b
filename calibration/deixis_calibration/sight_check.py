"""What `deixis doctor --camera` looks at: some seconds of a running system's frames and tracks, or of a source here."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from deixis_cli.inbox import Inbox
from deixis_cli.options import CommandError
from deixis_runtime.finding import CameraLook, Finding
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import Unreachable, open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, FrameId, Track, Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import FrameRefused
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from .lens_picture import write_picture
from .looking import Looking
from .picture_measures import Image
from .picture_sources import open_source
from .sight_advice import advise
from .sight_picture import draw_sight

LOOK_S = 6.0
"""Within this the tracker believes a head, and somebody can raise a hand."""
MOST_FRAMES = 150
TURN_S = 0.1
KEPT = 32
"""Frames that wait for their tracks: a second of them, 30 MB as raw VGA."""
SILENT = "is the camera running ('deixis status')? may frames leave the robot (--frames-stay, this certificate's role)?"
OnPart = Callable[[float], None]


@dataclass(frozen=True)
class Shot:
    """One frame, and what the running tracker said of it; none where no other was asked."""

    image: Image
    run: int
    stamp_ns: int
    tracks: list[Track] | None = None


def look(asked: CameraLook) -> Iterator[Finding]:
    """Findings about what is seen through the camera; the picture is written where anything is seen."""
    cv2.setNumThreads(1)  # as the stage does
    looking, refused = Looking(TrackerConfig()), ""
    try:
        with Interrupts() as interrupts, _progress() as on_part:
            shots = heard(asked, interrupts, on_part) if asked.source is None else read(asked.source, interrupts, on_part)
            for shot in shots:
                try:
                    looking.add(shot.image, shot.run, shot.stamp_ns, shot.tracks)
                except FrameRefused as error:
                    refused = str(error)
    except CommandError as error:
        yield Finding("wrong", f"camera: nothing to look at: {error}")
        return
    except Unreachable:
        return  # doctor has said it already
    seen = looking.seen()
    if seen is None:
        yield Finding("wrong", f"camera: no picture came within {LOOK_S:g} s{': ' if refused else ''}{refused}", SILENT)
        return
    found = list(advise(seen))
    yield from found
    try:
        write_picture(asked.picture, draw_sight(seen, found))
    except OSError as error:
        yield Finding(
            "wrong", f"the picture '{asked.picture}' cannot be written: {error.strerror or error}", "name another file"
        )
    else:
        yield Finding("ok", f"what the tracker sees is drawn in {asked.picture}")


def read(text: str, interrupts: Interrupts, on_part: OnPart) -> Iterator[Shot]:
    """Frames of a source of this machine. Raises CommandError."""
    began_s = time.monotonic()
    with open_source([text], interrupts) as source:
        for number, picture in enumerate(source.pictures):
            passed_s = time.monotonic() - began_s
            on_part(passed_s / LOOK_S if source.live else number / min(MOST_FRAMES, source.total or MOST_FRAMES))
            if interrupts.requested() or (passed_s > LOOK_S if source.live else number >= MOST_FRAMES):
                return
            if picture.image is not None:
                yield Shot(_coloured(picture.image), 0, picture.time_ns)


def heard(asked: CameraLook, interrupts: Interrupts, on_part: OnPart) -> Iterator[Shot]:
    """Frames of a running system, each with its tracks: it waits for these for a turn or two. Raises Unreachable."""
    assert asked.robot is not None, "without a source a robot is named"
    with open_client(asked.connect, shared_memory=False) as session:
        inbox = Inbox()
        keys = topics.FRAME.key(asked.robot), topics.TRACKS.key(asked.robot)
        subscribers = [session.declare_subscriber(key, inbox.store) for key in keys]
        pairs, began_s = Pairs(), time.monotonic()
        while (passed_s := time.monotonic() - began_s) < LOOK_S and not interrupts.requested():
            on_part(passed_s / LOOK_S)
            inbox.wait(TURN_S)
            for raw in inbox.take_raw():
                try:
                    pairs.hear(raw.key, raw.payload, raw.encoding)
                except codec.CodecError:
                    continue  # doctor's other findings say who breaks the contract
            yield from pairs.take()
        for subscriber in subscribers:
            subscriber.undeclare()  # type: ignore[no-untyped-call]
        yield from pairs.rest()


class Pairs:
    """Frames and tracks by the frame that they are of: the tracker answers some frames only, and each a moment later."""

    def __init__(self) -> None:
        self._frames: dict[FrameId, Frame] = {}
        self._tracks: dict[FrameId, list[Track]] = {}
        self._any_paired = False

    def hear(self, key: str, payload: bytes, encoding: str) -> None:
        """Take in a message. Raises codec.CodecError."""
        if key.endswith("/" + topics.TRACKS.path):
            tracks = codec.decode(Tracks, payload, encoding, max_bytes=topics.TRACKS.max_bytes)
            self._tracks[tracks.frame_id] = tracks.tracks
            _bound(self._tracks)
        else:
            frame = codec.decode(Frame, payload, encoding, max_bytes=topics.FRAME.max_bytes)
            self._frames[frame.frame_id] = frame
            _bound(self._frames)

    def take(self) -> Iterator[Shot]:
        """The frames whose tracks are here, in their order, each once."""
        for name in [name for name in self._frames if name in self._tracks]:
            self._any_paired = True
            yield from _shot(self._frames.pop(name), self._tracks.pop(name))

    def rest(self) -> Iterator[Shot]:
        """The last frames, where none had tracks: no tracker runs."""
        if not self._any_paired:
            for frame in self._frames.values():
                yield from _shot(frame, None)


def _bound(kept: dict[FrameId, Any]) -> None:
    if len(kept) > KEPT:
        del kept[next(iter(kept))]


@contextmanager
def _progress() -> Iterator[OnPart]:
    """A bar of the seconds that are looked, on standard error."""
    columns = TextColumn("looking: stand before the camera and raise a hand"), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("", total=1.0)
        yield lambda part: progress.update(task, completed=min(1.0, part))


def _shot(frame: Frame, tracks: list[Track] | None) -> Iterator[Shot]:
    try:
        yield Shot(decode_image(frame), frame.run, frame.stamp_ns, tracks)
    except ImageError:
        return  # the stages refuse it, and their health says so


def _coloured(image: Image) -> Image:
    return image if image.ndim == 3 else np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), np.uint8)
