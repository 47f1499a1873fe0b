"""Why a camera, a file or a picture does not work, in words; and what a file is by its first bytes.

Nothing here is on a picture's way: it is asked when something is opened, and when it fails.
"""

from __future__ import annotations

import errno
import fcntl
import os
import struct
from collections.abc import Iterator
from pathlib import Path

from .sources import SourceRefused

# linux/videodev2.h: _IOR('V', 0, struct v4l2_capability), _IOWR('V', 8, struct v4l2_requestbuffers)
VIDIOC_QUERYCAP = 0x80685600
VIDIOC_REQBUFS = 0xC0145608
CAPTURE_BITS = 0x00000001 | 0x00001000  # V4L2_CAP_VIDEO_CAPTURE, V4L2_CAP_VIDEO_CAPTURE_MPLANE
DEVICE_CAPS_BIT = 0x80000000
BUFFER_TYPE_CAPTURE = 1
MEMORY_MMAP = 1

HEAD_BYTES = 1024
FORMATS_BY_START = {
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

JPEG_START, JPEG_END = b"\xff\xd8", b"\xff\xd9"
START_OF_SCAN = 0xDA
FRAME_HEADERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # SOF0 to SOF15, without DHT, JPG and DAC
PNG_START = b"\x89PNG\r\n\x1a\n"


# --- devices ----------------------------------------------------------------------------------------------------------


def why_not_openable(path: str) -> str | None:
    """Why a device file cannot be opened, to follow its name in a sentence; None where it can."""
    try:
        os.close(os.open(path, os.O_RDWR | os.O_NONBLOCK))
    except OSError as error:
        return _say(error, path)
    return None


def why_no_pictures(path: str) -> str:
    """Why a device file that can be opened gives no pictures, to follow its name in a sentence."""
    try:
        file = os.open(path, os.O_RDWR | os.O_NONBLOCK)
    except OSError as error:
        return _say(error, path)
    try:
        if not _captures_video(file):
            return "is not a camera (it cannot capture video)"
        # Asking for no buffers changes nothing, and is refused with EBUSY while another program streams from the device.
        fcntl.ioctl(file, VIDIOC_REQBUFS, bytearray(struct.pack("=5I", 0, BUFFER_TYPE_CAPTURE, MEMORY_MMAP, 0, 0)))
    except OSError as error:
        return _say(error, path)
    finally:
        os.close(file)
    return "is there but gives no picture"


def _captures_video(file: int) -> bool:
    answer = bytearray(104)
    try:
        fcntl.ioctl(file, VIDIOC_QUERYCAP, answer)
    except OSError as error:
        if error.errno in (errno.ENOTTY, errno.EINVAL):
            return False
        raise
    capabilities, of_this_node = struct.unpack_from("=2I", answer, 84)
    return bool((of_this_node if capabilities & DEVICE_CAPS_BIT else capabilities) & CAPTURE_BITS)


def _say(error: OSError, path: str) -> str:
    if error.errno in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        others = sorted(str(other) for other in Path("/dev").glob("video*") if str(other) != path)
        there = f"there are {', '.join(others)}" if others else "no other camera is there either"
        return f"is not there (not plugged in?); {there}"
    if error.errno in (errno.EACCES, errno.EPERM):
        return "may not be used by this user (permission denied; is the user in the group 'video'?)"
    if error.errno == errno.EBUSY:
        return f"is busy: another program uses it{_holders(path)}"
    return f"cannot be opened: {error.strerror or error}"


def _holders(path: str) -> str:
    """Programs of this user that have the device open, as far as /proc tells."""
    names = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            held = any(os.readlink(handle) == path for handle in (process / "fd").iterdir())
            name = (process / "comm").read_text().strip() if held else ""
        except OSError:
            continue  # gone meanwhile, or another user's
        if held and int(process.name) != os.getpid():
            names.append(f"{name}, process {process.name}")
    return f" ({'; '.join(sorted(names))})" if names else ""


# --- files ------------------------------------------------------------------------------------------------------------


def refuse_unreadable(path: Path) -> None:
    """Raise SourceRefused where `path` is missing, not ours to read, not a file, or empty."""
    try:
        status = path.stat()
        with path.open("rb"):
            pass
    except FileNotFoundError:
        folder = path.absolute().parent
        near = "" if folder.is_dir() else f" (nor does its folder '{folder}')"
        raise SourceRefused(f"file '{path}' does not exist{near}") from None
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
    head = head_of(path)
    if video_format(head) is None:
        looks = "it holds text" if _is_text(head) else "its content is of no known video format"
        raise SourceRefused(f"file '{path}' is not a video: {looks}")


def why_no_video(path: Path) -> str:
    """Why FFmpeg cannot open a file that begins like a video, to end a sentence."""
    if video_format(head_of(path)) == "mp4" and not _has_atom(path, b"moov"):
        return "it is cut off (its index, the 'moov' atom, is missing)"
    return "it is damaged, or in a format that this FFmpeg does not know"


def head_of(path: Path) -> bytes:
    """The first bytes of a file, enough for `video_format`. Raises OSError."""
    with path.open("rb") as file:
        return file.read(HEAD_BYTES)


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
    return next((name for start, name in FORMATS_BY_START.items() if head.startswith(start)), None)


def _is_text(head: bytes) -> bool:
    return bool(head) and not any(byte < 9 or 13 < byte < 32 for byte in head)


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


# --- pictures ---------------------------------------------------------------------------------------------------------


def why_not_decodable(data: bytes, longest_px: int) -> str | None:
    """Why a picture file is not to be decoded, to follow its name in a sentence; None where nothing is against it.

    Asked before decoding: OpenCV fills a JPEG that is cut off up with grey, and a few kilobytes of JPEG or PNG can claim
    65535 pixels a side.
    """
    if not data:
        return "is empty (0 bytes)"
    if data.startswith(JPEG_START) and not _jpeg_is_whole(data):
        return "is cut off"
    width, height = _stated_size(data) or (0, 0)
    if max(width, height) > longest_px:
        return f"is too large: {width} x {height}, at most {longest_px} pixels a side are taken"
    return None


def _stated_size(data: bytes) -> tuple[int, int] | None:
    """(width, height) by the header of a JPEG or PNG; None where it has none, or is of another format."""
    if data.startswith(PNG_START) and data[12:16] == b"IHDR":
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if data.startswith(JPEG_START):
        for marker, place in _jpeg_segments(data):
            if marker in FRAME_HEADERS:
                return int.from_bytes(data[place + 5 : place + 7], "big"), int.from_bytes(data[place + 3 : place + 5], "big")
    return None


def _jpeg_is_whole(data: bytes) -> bool:
    scan = next((place for marker, place in _jpeg_segments(data) if marker == START_OF_SCAN), None)
    return scan is not None and data.find(JPEG_END, scan) >= 0


def _jpeg_segments(data: bytes) -> Iterator[tuple[int, int]]:
    """Marker of each segment up to the first scan, and the place of its length (ITU-T T.81, B.1.1).

    By their lengths: a thumbnail inside a segment has markers of its own.
    """
    place = len(JPEG_START)
    while place + 4 <= len(data) and data[place] == 0xFF:
        marker = data[place + 1]
        if marker == 0xFF:  # a fill byte
            place += 1
            continue
        yield marker, place + 2
        if marker == START_OF_SCAN:
            return
        place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
