"""Folders of pictures, and single pictures."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from deixis_schemas.messages import MAX_SIDE_PX

from .diagnosis import head_of, video_format, why_not_decodable
from .sources import Image, Picture, PictureRefused, SourceRefused

SUFFIXES = frozenset(
    {".jpg", ".jpeg", ".jpe", ".png", ".bmp", ".dib", ".webp", ".tif", ".tiff", ".pgm", ".ppm", ".pbm", ".pnm", ".jp2"}
)
MJPEG_SUFFIXES = frozenset({".mjpg", ".mjpeg"})
FOLDER_RATE_HZ = 5.0


class Pictures:
    """Pictures of a folder in natural order of their names, or one picture, played at `rate_hz`."""

    live = False

    def __init__(self, path: Path, rate_hz: float | None = None) -> None:
        self._path = path
        self._pictures: Sequence[Path] = ()
        self._next = 0
        self.name = str(path)
        self.rate_hz = rate_hz or FOLDER_RATE_HZ

    def open(self) -> None:
        """List the pictures. Raises SourceRefused where there are none."""
        self._pictures = picture_files(self._path) if self._path.is_dir() else [self._path]
        self._next = 0

    def read(self) -> Picture | None:
        """The next picture; None after the last. Raises PictureRefused for one that cannot be read; it keeps its `seq`."""
        if self._next >= len(self._pictures):
            return None
        seq = self._next
        self._next += 1
        return Picture(seq=seq, time_ns=round(seq * 1e9 / self.rate_hz), image=read_picture(self._pictures[seq]))

    def close(self) -> None:
        """Forget the listing."""
        self._pictures = ()


def picture_files(folder: Path) -> list[Path]:
    """Pictures of `folder` (by suffix) in natural order: 2.png before 10.png. Raises SourceRefused where there are none."""
    try:
        names = [entry.name for entry in os.scandir(folder) if entry.is_file()]
    except PermissionError:
        raise SourceRefused(f"folder '{folder}' may not be read by this user (permission denied)") from None
    except OSError as error:
        raise SourceRefused(f"folder '{folder}' cannot be read: {error.strerror or error}") from None
    pictures = [name for name in names if Path(name).suffix.lower() in SUFFIXES and not name.startswith(".")]
    if not pictures:
        found = f"none of its {len(names)} files is one" if names else "it is empty"
        raise SourceRefused(f"folder '{folder}' has no pictures (.jpg, .png, .bmp, .webp, .tif, .pgm, .ppm): {found}")
    return [folder / name for name in sorted(pictures, key=natural_order)]


def is_picture(path: Path) -> bool:
    """Whether a file is one picture: GIFs may be animated and MJPEG begins like a JPEG, so both are videos."""
    if video_format(head_of(path)) == "gif" or path.suffix.lower() in MJPEG_SUFFIXES:
        return False
    return bool(cv2.haveImageReader(str(path)))


def natural_order(name: str) -> tuple[list[tuple[int, int, str]], str]:
    """Sort key that compares digits as numbers and the rest without case; equal ones by the plain name."""
    parts = re.findall(r"\d+|\D+", name)
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part.casefold()) for part in parts], name


def read_picture(path: Path) -> Image:
    """The picture, (H, W) or (H, W, 3), 8 or 16 bit, upright by its EXIF entry. Raises PictureRefused."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise PictureRefused(f"picture '{path.name}' cannot be read: {error.strerror or error}") from None
    cause = why_not_decodable(data, MAX_SIDE_PX)
    if cause:
        raise PictureRefused(f"picture '{path.name}' {cause}")
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR)
    except cv2.error as error:
        raise PictureRefused(f"picture '{path.name}' cannot be decoded: {error.err or 'too large'}") from None
    if image is None:
        raise PictureRefused(f"picture '{path.name}' cannot be decoded: not a picture, or damaged")
    return image
