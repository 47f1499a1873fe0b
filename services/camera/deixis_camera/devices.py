"""Cameras of this machine (V4L2)."""

from __future__ import annotations

import errno
import fcntl
import os
import struct
from collections.abc import Callable
from pathlib import Path

import cv2

from .config import CameraConfig
from .sources import Picture, SourceLost

# linux/videodev2.h: _IOR('V', 0, struct v4l2_capability), _IOWR('V', 8, struct v4l2_requestbuffers)
VIDIOC_QUERYCAP = 0x80685600
VIDIOC_REQBUFS = 0xC0145608
CAPTURE_BITS = 0x00000001 | 0x00001000  # V4L2_CAP_VIDEO_CAPTURE, V4L2_CAP_VIDEO_CAPTURE_MPLANE
DEVICE_CAPS_BIT = 0x80000000
BUFFER_TYPE_CAPTURE = 1
MEMORY_MMAP = 1
WARM_UP_READS = 3


class Device:
    """A V4L2 camera, read at its own rate. `now_ns` gives the Unix time of a picture's arrival."""

    live = True

    def __init__(self, path: str, config: CameraConfig, now_ns: Callable[[], int]) -> None:
        self._path = path
        self._config = config
        self._now_ns = now_ns
        self._capture: cv2.VideoCapture | None = None
        self._seq = 0
        self.name = path
        self.rate_hz = 0.0

    def open(self) -> None:
        """Open the device and ask it for the size, rate and format of the settings. Raises SourceLost with the cause."""
        self.close()
        cause = why_not_openable(self._path)
        if cause:
            raise SourceLost(f"camera '{self._path}' {cause}")
        capture = cv2.VideoCapture(self._path, cv2.CAP_V4L2)
        if not capture.isOpened():
            capture.release()
            raise SourceLost(f"camera '{self._path}' {why_no_pictures(self._path)}")
        self._ask_for_settings(capture)
        if not any(capture.grab() for _ in range(WARM_UP_READS)):
            capture.release()
            raise SourceLost(f"camera '{self._path}' {why_no_pictures(self._path)}")
        self._capture = capture
        rate = capture.get(cv2.CAP_PROP_FPS)
        self.rate_hz = float(rate) if 0 < rate <= 240 else 0.0

    def read(self) -> Picture:
        """Wait for the next picture. Raises SourceLost when the device has gone or stopped."""
        good, image = self._capture.read() if self._capture is not None else (False, None)
        if not good or image is None:
            cause = why_not_openable(self._path) or "stopped giving pictures (unplugged, or taken by another program)"
            raise SourceLost(f"camera '{self._path}' {cause}")
        picture = Picture(seq=self._seq, time_ns=self._now_ns(), image=image)
        self._seq += 1
        return picture

    def close(self) -> None:
        """Give the device back."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None

    def _ask_for_settings(self, capture: cv2.VideoCapture) -> None:
        config = self._config
        if config.pixel_format:
            capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*config.pixel_format))
        if config.width:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, config.width)
        if config.height:
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, config.height)
        if config.rate_hz:
            capture.set(cv2.CAP_PROP_FPS, config.rate_hz)


def why_not_openable(path: str) -> str | None:
    """Why the device file cannot be opened, to follow its name in a sentence; None where it can."""
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
