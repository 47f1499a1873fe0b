"""What every kind of source has in common, and what a source string names."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol
from urllib.parse import unquote, urlsplit

import numpy as np
from numpy.typing import NDArray

STREAM_SCHEMES = ("http", "https", "rtsp", "rtsps")

Image = NDArray[np.integer | np.floating]


class SourceError(Exception):
    """A source that does not deliver. The text is one sentence that names the source and the cause."""


class SourceRefused(SourceError):
    """Trying again cannot help: a missing file, a file that is not a video."""


class SourceLost(SourceError):
    """May come back: a device that is unplugged or busy, a stream that does not answer."""


class SourceBroken(SourceError):
    """A recording that ends before its end; what came before the break was good."""


class PictureRefused(Exception):
    """One picture that cannot be used; the next may be good. The text names the cause."""


@dataclass(frozen=True)
class Picture:
    """A picture as it comes from a source.

    seq: of a recording the picture's index from 0, of a live source the count of pictures read.
    time_ns: of a recording media time from its start; of a live source the time of its capture on the monotonic clock.
    image: (H, W) or (H, W, channels), any integer depth.
    """

    seq: int
    time_ns: int
    image: Image


class Source(Protocol):
    """Something to read pictures from. All calls may block and come from one thread."""

    @property
    def name(self) -> str:
        """For people, without credentials."""

    @property
    def live(self) -> bool:
        """Pictures come in their own time and the newest wins; False for a recording. Known after `open`."""

    @property
    def rate_hz(self) -> float:
        """Nominal rate, 0 where it is unknown. Known after `open`."""

    def open(self) -> None:
        """Open, or open anew from the start. Raises SourceRefused or SourceLost."""

    def read(self) -> Picture | None:
        """The next picture; None at the end of a recording.

        Raises PictureRefused (the next may be good), SourceLost (a live source) or SourceBroken (a recording).
        """

    def close(self) -> None:
        """Let go of the device or file; harmless when closed."""


def device_path(source: str) -> str | None:
    """Path of the video device that `source` names by number or path; None where it names something else."""
    if re.fullmatch(r"\d{1,3}", source):
        return f"/dev/video{int(source)}"
    return source if Path(source).is_char_device() or re.fullmatch(r"/dev/video\d+", source) else None


def is_stream(source: str) -> bool:
    """Whether `source` is a URL that is opened over the network."""
    return split_scheme(source)[0] in STREAM_SCHEMES


def local_path(source: str) -> Path:
    """The file or folder that `source` names. Raises SourceRefused for a URL of a scheme that no reader has."""
    scheme, _ = split_scheme(source)
    if scheme == "file":
        return Path(unquote(urlsplit(source).path))
    if scheme:
        raise SourceRefused(f"'{without_credentials(source)}': URLs start with {'://, '.join(STREAM_SCHEMES)}:// or file://")
    return Path(source)


def split_scheme(source: str) -> tuple[str, str]:
    """(scheme, rest) of a URL; ('', source) where it is none."""
    scheme, mark, rest = source.partition("://")
    return (scheme.lower(), rest) if mark and re.fullmatch(r"[A-Za-z][A-Za-z0-9+.\-]*", scheme) else ("", source)


def without_credentials(source: str) -> str:
    """`source` as it may be shown: a URL without user, password and query (cameras take passwords there too)."""
    scheme, rest = split_scheme(source)
    if not scheme:
        return source
    head, mark, query = rest.partition("?")
    authority = head.partition("/")[0]
    if "@" in head:
        head = head.rpartition("@")[2]  # also where a password holds an unescaped '/' or '@'
    elif "@" in query and not re.fullmatch(r"(\[[^\]]*\]|[^:]*)(:\d*)?", authority):
        head, mark = query.rpartition("@")[2].partition("?")[0], "?"  # 'user:pass?word@host': not a port, so a password
    return f"{scheme}://{head.partition('#')[0]}" + ("?..." if mark else "")
