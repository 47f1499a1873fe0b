"""The messages of a recording for the painter, and pictures for one that has none."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
from deixis_cli.mcap_file import McapReader
from deixis_cli.options import CommandError
from deixis_cli.raw_message import RawMessage
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, Tracks

SEEN_AT = topics.TRACKS


def messages(recording: McapReader, clip: Path | None) -> Iterator[RawMessage]:
    """What a recording holds, in its order; with the pictures of `clip` where one is given.

    Raises McapFileError, and CommandError for a clip that is none, or not of this recording.
    """
    pictures = _ClipPictures(clip) if clip is not None else None
    for raw in recording:
        if pictures is not None and topics.topic_of(raw.key) is SEEN_AT:
            frame = pictures.of(raw)
            if frame is not None:
                yield frame
        yield raw


class _ClipPictures:
    """Frames of the clip that a recording was made of: a file's `seq` is the frame's index in it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._open()

    def of(self, raw: RawMessage) -> RawMessage | None:
        """The frame that these tracks were seen in, as it would have been sent; none where the clip has no such frame."""
        try:
            tracks = codec.decode(Tracks, raw.payload, raw.encoding)
        except codec.CodecError:
            return None  # the painter reports it
        image = self._image(tracks.seq)
        if image is None:
            return None
        height, width = image.shape[:2]
        if (width, height) != (tracks.width, tracks.height):
            raise CommandError(
                f"'{self._path}' is {width} x {height}, but the recording was made of {tracks.width} x {tracks.height}"
            )
        frame = Frame.model_validate(
            {
                # No stage's name: when the camera said it is not known, and so no delay of its is drawn.
                **{"run": tracks.run, "seq": tracks.seq, "stamp_ns": tracks.stamp_ns, "stage": "clip"},
                **{"instance": "clip", "width": width, "height": height, "encoding": "bgr8", "data": image.tobytes()},
            }
        )
        key = f"{raw.key.removesuffix(topics.TRACKS.path)}{topics.FRAME.path}"
        return RawMessage(key, codec.encoding_of(Frame), codec.encode(frame), raw.received_ns)

    def _image(self, seq: int) -> np.ndarray | None:
        if seq < self._next:  # a new pass of --loop
            self._open()
        while self._next < seq:
            if not self._capture.grab():
                return None
            self._next += 1
        ok, image = self._capture.read()
        self._next += 1
        return image if ok else None

    def _open(self) -> None:
        self._capture = cv2.VideoCapture(str(self._path))
        self._next = 0
        if not self._capture.isOpened():
            raise CommandError(f"'{self._path}': no clip that can be played")


def paint_all(raws: Iterator[RawMessage], take: Callable[[RawMessage], None], stopped: Callable[[], bool]) -> None:
    """Take all to the painter until it is over, or somebody stops."""
    for raw in raws:
        if stopped():
            break
        take(raw)
