"""Which reader a source string gets."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2

from .config import CameraConfig
from .devices import Device
from .files import HEAD_BYTES, VideoFile, refuse_unreadable, video_format
from .folders import Pictures
from .sources import Source, device_path, is_stream, local_path
from .streams import Stream

MJPEG_SUFFIXES = frozenset({".mjpg", ".mjpeg"})


def source_for(config: CameraConfig, now_ns: Callable[[], int]) -> Source:
    """The reader for `config.source`, not opened yet.

    A number or a device file is a camera, a URL a stream, a folder or a picture its pictures, all else a video file.
    Raises SourceRefused for a file that is missing, unreadable or empty, and for a URL of an unknown scheme.
    """
    device = device_path(config.source)
    if device is not None:
        return Device(device, config, now_ns)
    if is_stream(config.source):
        return Stream(config.source, config, now_ns)
    path = local_path(config.source)
    if path.is_dir():
        return Pictures(path, config.rate_hz)
    refuse_unreadable(path)
    if _is_picture(path):
        return Pictures(path, config.rate_hz)
    return VideoFile(
        path, open_timeout_s=config.open_timeout_s, read_timeout_s=config.read_timeout_s, threads=config.decoder_threads
    )


def _is_picture(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if video_format(head) == "gif" or path.suffix.lower() in MJPEG_SUFFIXES:
        return False
    return bool(cv2.haveImageReader(str(path)))
