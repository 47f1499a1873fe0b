"""Video files and animated GIFs."""

from __future__ import annotations

import os
from pathlib import Path

from .decoder import Decoder
from .sources import Picture, SourceBroken, SourceRefused

HEAD_BYTES = 1024
MISSING_SHARE = 0.02
"""Containers state the number of frames to within a few; more missing than this share means that the file is cut off."""


class VideoFile:
    """A video file or animated GIF, read with FFmpeg."""

    live = False

    def __init__(self, path: Path, *, open_timeout_s: float = 5.0, read_timeout_s: float = 5.0, threads: int = 1) -> None:
        self._path = path
        self._limits = {"open_timeout_s": open_timeout_s, "read_timeout_s": read_timeout_s}
        self._threads = threads
        self._decoder: Decoder | None = None
        self._read = 0
        self.name = str(path)
        self.rate_hz = 0.0

    def open(self) -> None:
        """Open from the start. Raises SourceRefused with the cause."""
        self.close()
        refuse_unreadable(self._path)
        refuse_non_video(self._path)
        try:
            self._decoder = Decoder(str(self._path), **self._limits, threads=self._threads)
        except OSError:
            raise SourceRefused(f"video file '{self._path}' cannot be decoded{_why(self._path)}") from None
        self.rate_hz = self._decoder.rate_hz
        self._read = 0

    def read(self) -> Picture | None:
        """The next frame; None at the end. Raises SourceBroken where the file is cut off or damaged."""
        if self._decoder is None:
            raise SourceBroken(f"video file '{self._path}' is not open")
        image = self._decoder.read()
        if image is None:
            self._refuse_early_end(self._decoder.expected_frames)
            return None
        picture = Picture(seq=self._read, time_ns=self._decoder.media_ns(), image=image)
        self._read += 1
        return picture

    def close(self) -> None:
        """Close the file."""
        if self._decoder is not None:
            self._decoder.close()
            self._decoder = None

    def _refuse_early_end(self, expected: int) -> None:
        if expected - self._read > max(1.0, MISSING_SHARE * expected):
            raise SourceBroken(
                f"video file '{self._path}' is cut off or damaged: {self._read} of about {expected} frames could be read"
            )


def refuse_unreadable(path: Path) -> None:
    """Raise SourceRefused where `path` is missing, not ours to read, not a file, or empty."""
    try:
        status = path.stat()
        with path.open("rb"):
            pass
    except FileNotFoundError:
        raise SourceRefused(f"file '{path}' does not exist{_near(path)}") from None
    except PermissionError:
        raise SourceRefused(f"file '{path}' may not be read by this user (permission denied)") from None
    except OSError as error:
        raise SourceRefused(f"file '{path}' cannot be read: {error.strerror or error}") from None
    if status.st_size == 0:
        raise SourceRefused(f"file '{path}' is empty (0 bytes)")


def refuse_non_video(path: Path) -> None:
    """Raise SourceRefused where the content is of no known video format.

    FFmpeg's guess is not enough: it plays a text file as a film of a terminal, and random bytes as one odd picture.
    """
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if video_format(head) is None:
        looks = "it holds text" if _is_text(head) else "its content is of no known video format"
        raise SourceRefused(f"file '{path}' is not a video: {looks}")


def video_format(head: bytes) -> str | None:
    """Container that the first bytes of a file speak of; None for none that is known."""
    if head[4:8] in (b"ftyp", b"moov", b"mdat", b"free", b"wide", b"skip"):
        return "mp4"
    if head[:4] == b"RIFF" and head[8:12] in (b"AVI ", b"AVIX"):
        return "avi"
    if head[:1] == b"\x47" and head[188:189] == b"\x47":
        return "mpegts"
    if head[4:5] == b"\x47" and head[196:197] == b"\x47":
        return "m2ts"
    return next((name for start, name in _STARTS.items() if head.startswith(start)), None)


_STARTS = {
    b"\x1a\x45\xdf\xa3": "matroska",
    b"GIF87a": "gif",
    b"GIF89a": "gif",
    b"OggS": "ogg",
    b"FLV": "flv",
    b"\x30\x26\xb2\x75\x8e\x66\xcf\x11": "asf",
    b"\x00\x00\x01\xba": "mpegps",
    b"\x00\x00\x01\xb3": "mpegvideo",
    b"\x00\x00\x00\x01": "h26x",
    b"\x00\x00\x01": "h26x",
    b"YUV4MPEG2": "yuv4mpeg",
    b"\xff\xd8\xff": "mjpeg",
    b"\x06\x0e\x2b\x34": "mxf",
    b".RMF": "realmedia",
    b"DKIF": "ivf",
}


def _is_text(head: bytes) -> bool:
    return bool(head) and not any(byte < 9 or 13 < byte < 32 for byte in head)


def _why(path: Path) -> str:
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if video_format(head) == "mp4" and not _has_atom(path, b"moov"):
        return ": it is cut off (its index, the 'moov' atom, is missing)"
    return ": it is damaged, or in a format that this FFmpeg does not know"


def _has_atom(path: Path, wanted: bytes) -> bool:
    """Whether an MP4 file has a top-level atom of that name (ISO/IEC 14496-12, 4.2)."""
    size = path.stat().st_size
    with path.open("rb") as file:
        while file.tell() + 8 <= size:
            start = file.tell()
            length, name = int.from_bytes(file.read(4), "big"), file.read(4)
            if name == wanted:
                return True
            if length == 1:
                length = int.from_bytes(file.read(8), "big")
            if length < 8:
                return False
            file.seek(start + length, os.SEEK_SET)
    return False


def _near(path: Path) -> str:
    folder = path.absolute().parent
    return "" if folder.is_dir() else f" (nor does its folder '{folder}')"
