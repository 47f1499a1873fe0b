"""Pictures to look for a board in: files and folders, a video, a camera, or the frames of a running camera stage."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from deixis_camera.capture import source_for
from deixis_camera.config import CameraConfig
from deixis_camera.folders import FOLDER_RATE_HZ, is_picture, picture_files, read_picture
from deixis_camera.pictures import Normaliser
from deixis_camera.sources import Image as AnyImage
from deixis_camera.sources import PictureRefused, Source, SourceError, device_path, is_stream, local_path
from deixis_cli.inbox import Inbox
from deixis_cli.options import CommandError
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import MAX_SIDE_PX, Frame
from numpy.typing import NDArray
from pydantic import ValidationError

Image = NDArray[np.uint8]
TURN_S = 0.1
SILENT_S = 5.0
"""Without a frame of the camera stage for so long, it is said to be silent."""


@dataclass(frozen=True)
class Named:
    """One picture: a name for people, and (h, w) or (h, w, 3) BGR pixels; none with why it cannot be used.

    number: of a video or camera that of the picture, from 0. time_ns: of a recording from its start, else on a steady clock.
    """

    name: str
    image: Image | None
    why: str = ""
    number: int = 0
    time_ns: int = 0


@dataclass(frozen=True)
class PictureSource:
    """Pictures in their order. total: how many, none where that is unknown. moving: the board moves from one to the next, as
    in a video. live: there is no end, and the newest is looked at.
    """

    name: str
    pictures: Iterator[Named]
    total: int | None
    moving: bool = False
    live: bool = False


def files_of(sources: Sequence[str]) -> list[Path] | None:
    """Picture files that these files and folders are or hold; none where one is a video, a camera or a stream.

    Raises CommandError for what is not there.
    """
    files: list[Path] = []
    for text in sources:
        if device_path(text) is not None or is_stream(text):
            return None
        try:
            path = local_path(text)
            if path.is_dir():
                files += picture_files(path)
                continue
        except SourceError as error:
            raise CommandError(str(error)) from None
        if not path.exists():
            raise CommandError(f"'{text}': no such file or folder")
        if not is_picture(path):
            return None
        files.append(path)
    return files


@contextmanager
def open_source(sources: Sequence[str], interrupts: Interrupts) -> Iterator[PictureSource]:
    """What these name: any number of picture files and folders, or one video, camera or stream. Raises CommandError."""
    files = files_of(sources)
    if files is not None:
        yield PictureSource(", ".join(sources), _read_files(files), len(files))
        return
    if len(sources) > 1:
        raise CommandError("several sources have to be pictures and folders; of videos, cameras and streams give one")
    try:
        source = source_for(CameraConfig(source=sources[0]))
        source.open()
    except ValidationError as error:
        raise CommandError(f"source '{sources[0][:200]}': {error.errors()[0]['msg']}") from None
    except SourceError as error:
        raise CommandError(str(error)) from None
    try:
        pictures = _newest(source, interrupts) if source.live else _in_turn(source)
        yield PictureSource(source.name, pictures, getattr(source, "expected", 0) or None, moving=True, live=source.live)
    finally:
        source.close()


@contextmanager
def open_camera_stage(robot: str, connect: str, interrupts: Interrupts) -> Iterator[PictureSource]:
    """The frames of that robot's camera stage. Raises Unreachable, and CommandError where none comes."""
    with open_client(connect, shared_memory=False) as session:
        inbox = Inbox()
        subscriber = session.declare_subscriber(topics.FRAME.key(robot), inbox.store)
        try:
            yield PictureSource(f"camera of robot '{robot}'", _heard(inbox, robot, interrupts), None, moving=True, live=True)
        finally:
            subscriber.undeclare()  # type: ignore[no-untyped-call]


def _read_files(files: Sequence[Path]) -> Iterator[Named]:
    for number, path in enumerate(files):
        try:
            image = read_picture(path)
        except PictureRefused as error:
            yield Named(path.name, None, str(error))
        else:
            yield _named(path.name, image, Normaliser(MAX_SIDE_PX), number, round(number * 1e9 / FOLDER_RATE_HZ))


def _named(name: str, image: AnyImage, normaliser: Normaliser, number: int, time_ns: int) -> Named:
    try:
        return Named(name, normaliser.normalise(image), "", number, time_ns)
    except PictureRefused as error:
        return Named(name, None, str(error), number, time_ns)


def _in_turn(source: Source) -> Iterator[Named]:
    """All pictures of a recording; where it is broken, why is the last of them."""
    normaliser = Normaliser(MAX_SIDE_PX)
    while True:
        try:
            picture = source.read()
        except PictureRefused as error:
            yield Named("?", None, str(error))
            continue
        except SourceError as error:
            yield Named(source.name, None, str(error))
            return
        if picture is None:
            return
        yield _named(f"{picture.time_ns / 1e9:.2f} s", picture.image, normaliser, picture.seq, picture.time_ns)


@dataclass
class _Slot:
    """The newest picture of a camera that is read by a thread of its own, so that none waits in a queue and grows old."""

    source: Source
    stop: bool = False
    newest: Named | None = None
    failure: str = ""
    lock: threading.Lock = field(default_factory=threading.Lock)

    def read_on(self) -> None:
        """What the thread does."""
        normaliser = Normaliser(MAX_SIDE_PX)
        while not self.stop and not self.failure:
            try:
                picture = self.source.read()
                if picture is None:
                    self.failure = f"'{self.source.name}' has ended"
                    return
                named = _named(f"picture {picture.seq}", picture.image, normaliser, picture.seq, picture.time_ns)
            except PictureRefused as error:
                named = Named("?", None, str(error))
            except SourceError as error:
                self.failure = str(error)
                return
            with self.lock:
                self.newest = named

    def take(self) -> Named | None:
        """The newest picture, once."""
        with self.lock:
            named, self.newest = self.newest, None
        return named


def _newest(source: Source, interrupts: Interrupts) -> Iterator[Named]:
    """The newest picture, again and again until interrupted. Raises CommandError where the camera is lost."""
    slot = _Slot(source)
    reader = threading.Thread(target=slot.read_on, daemon=True)
    reader.start()
    try:
        while not interrupts.requested():
            named = slot.take()
            if named is not None:
                yield named
            elif slot.failure:
                raise CommandError(slot.failure)
            else:
                time.sleep(0.005)
    finally:
        slot.stop = True
        reader.join(timeout=10)


def _heard(inbox: Inbox, robot: str, interrupts: Interrupts) -> Iterator[Named]:
    last_s, number = time.monotonic(), 0
    while not interrupts.requested():
        inbox.wait(TURN_S)
        heard = list(inbox.take_raw())
        if not heard:
            if time.monotonic() - last_s > SILENT_S:
                raise CommandError(
                    f"no frame of robot '{robot}' is heard: is its camera running ('deixis status'), and may frames leave the "
                    "robot (--frames-stay, the certificate's role)?"
                )
            continue
        last_s, raw = time.monotonic(), heard[-1]
        try:
            frame = codec.decode(Frame, raw.payload, raw.encoding, max_bytes=topics.FRAME.max_bytes)
            yield Named(f"frame {frame.seq}", decode_image(frame), number=number)
        except (codec.CodecError, ImageError) as error:
            yield Named("?", None, str(error), number)
        number += 1
