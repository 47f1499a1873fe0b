"""`--video DIR`: what the tracker says of each frame of a clip, as NAME.mp4."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cv2
from deixis_cli.options import CommandError
from deixis_schemas.messages import Track

from .clips import Clip, TrueFrame
from .replay import Picture
from .tracker_drawing import draw_tracks, drawn_scale
from .tracker_play import OnTracks

CODEC = "mp4v"  # the one that every wheel of OpenCV has


class VideoError(OSError):
    """A video that cannot be written."""


def check_video(folder: Path | None, clips: Sequence[Clip]) -> None:
    """Make the folder where one is named. Raises CommandError, also where a clip itself would be overwritten."""
    if folder is None:
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"--video {folder}: {error.strerror}") from None
    for clip in clips:
        written = video_of(folder, clip)
        if written.exists() and written.samefile(clip.video):
            raise CommandError(f"--video {folder}: '{written.name}' there is a clip that is played, and would be overwritten")


def video_of(folder: Path, clip: Clip) -> Path:
    """The video of a clip."""
    return folder / f"{clip.name}.mp4"


@contextmanager
def drawn_into(folder: Path | None, clip: Clip) -> Iterator[OnTracks]:
    """What draws the frames of a clip; does nothing without a folder. Raises VideoError."""
    if folder is None:
        yield lambda _picture, _truth, _tracks: None
        return
    path, meta = video_of(folder, clip), clip.truth.meta
    scale = drawn_scale(meta.width)
    size = meta.width * scale, meta.height * scale
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*CODEC), meta.fps, size)
    if not writer.isOpened():
        raise VideoError(f"'{path}' cannot be written: OpenCV {cv2.__version__} opens no video of {size[0]} x {size[1]} there")

    def draw(picture: Picture, truth: TrueFrame, tracks: Sequence[Track]) -> None:
        title = f"{clip.name}, frame {truth.frame}, {truth.frame / meta.fps:.2f} s"
        writer.write(draw_tracks(picture, tracks, truth, title))

    try:
        yield draw
    finally:
        writer.release()
