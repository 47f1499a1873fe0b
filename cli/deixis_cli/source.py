"""The SOURCE of `deixis run`: checked before anything starts, and named in output files."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urlsplit

from .options import CommandError

SCHEMES = ("http", "https", "rtsp", "rtsps", "file")


@dataclass(frozen=True)
class Source:
    """setting: value of the camera's `source`. name: stem of output files. live: it has no end of its own."""

    setting: str
    name: str
    live: bool


def read_source(text: str) -> Source:
    """What SOURCE names: a device number, file, folder or URL. Raises CommandError for a file that is not there."""
    if re.fullmatch(r"\d{1,3}", text):
        return Source(text, f"device{int(text)}", live=True)
    if re.fullmatch(r"/dev/video\d+", text):
        return Source(text, f"device{text.removeprefix('/dev/video')}", live=True)
    scheme, mark, _ = text.partition("://")
    if mark:
        return _url(text, scheme.lower())
    return _file(Path(text))


def _url(text: str, scheme: str) -> Source:
    if scheme not in SCHEMES:
        raise CommandError(f"source '{scheme}://...': URLs start with {', '.join(f'{known}://' for known in SCHEMES)}")
    try:
        parts = urlsplit(text)
        host = parts.hostname or ""
    except ValueError as error:
        raise CommandError(f"source '{scheme}://...': not a URL: {error}") from None
    if scheme == "file":
        return _file(Path(unquote(parts.path)))
    if not host:
        raise CommandError(f"source '{scheme}://...': the URL names no host")
    return Source(text, re.sub(r"[^A-Za-z0-9_.\-]", "_", host), live=True)


def _file(path: Path) -> Source:
    try:
        path = path.resolve()
        if not path.exists():
            raise CommandError(f"source '{path}': no such file or folder")
        if path.is_dir():
            empty = next(path.iterdir(), None) is None
        else:
            empty = path.is_file() and path.stat().st_size == 0
            with path.open("rb"):
                pass
    except OSError as error:
        raise CommandError(f"source '{path}': {error.strerror}") from None
    if empty:
        raise CommandError(f"source '{path}': the {'folder' if path.is_dir() else 'file'} is empty")
    return Source(str(path), path.stem or "run", live=False)
