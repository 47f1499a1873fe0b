"""Cameras that are missing, busy, not permitted or no cameras."""

import errno
import fcntl
import math
import os
import struct
import subprocess
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from deixis_camera import devices
from deixis_camera.config import CameraConfig
from deixis_camera.devices import Device, captured_ns
from deixis_camera.diagnosis import VIDIOC_QUERYCAP, VIDIOC_REQBUFS, why_no_pictures, why_not_openable
from deixis_camera.sources import SourceLost


def open_device(path: str) -> str:
    device = Device(path, CameraConfig(), lambda: 0)
    with pytest.raises(SourceLost) as loss:
        device.open()
    device.close()
    return str(loss.value)


def pretend_v4l(monkeypatch: pytest.MonkeyPatch, capabilities: int, refusal: int | None) -> None:
    """Answer V4L2's questions about any file as the kernel does for a device with these capabilities."""

    def ioctl(_file: int, request: int, answer: bytearray) -> int:
        if request == VIDIOC_QUERYCAP:
            answer[84:92] = struct.pack("=2I", capabilities, 0)
        elif request == VIDIOC_REQBUFS and refusal is not None:
            raise OSError(refusal, os.strerror(refusal))
        return 0

    monkeypatch.setattr(fcntl, "ioctl", ioctl)


MS = 1_000_000


class FakeCapture:
    """Stands in for cv2.VideoCapture on a V4L2 device: grabs `pictures`, the first while it is opened, then none.

    Its clock stands at `now_ns`: a period passes until each picture is there, and decoding one takes 50 ms. The driver stamps
    a buffer by that clock `buffered_ms` earlier, or with 0 where it does not know the time.
    """

    def __init__(self, pictures: int, buffered_ms: float | None = None) -> None:
        self.left = pictures
        self.now_ns = 5_000 * MS
        self.buffered_ms = buffered_ms
        self.stamp_ms = 0.0
        self.released = False
        self.settings: dict[int, float] = {}

    def set(self, name: int, value: float) -> bool:
        self.settings[name] = value
        return True

    def get(self, name: int) -> float:
        return self.stamp_ms if name == cv2.CAP_PROP_POS_MSEC else self.settings.get(name, 30.0)

    def grab(self) -> bool:
        self.left -= 1
        self.now_ns += 33 * MS
        self.stamp_ms = 0.0 if self.buffered_ms is None else self.now_ns / MS - self.buffered_ms
        return self.left >= 0

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        self.now_ns += 50 * MS
        return True, np.zeros((480, 640, 3), np.uint8)

    def release(self) -> None:
        self.released = True


def with_capture(monkeypatch: pytest.MonkeyPatch, capture: FakeCapture) -> None:
    monkeypatch.setattr(devices, "cv2", SimpleNamespace(**vars(cv2) | {"VideoCapture": lambda *_: capture}))


def opened_device(folder: Path, monkeypatch: pytest.MonkeyPatch, capture: FakeCapture, **settings: object) -> Device:
    path = folder / "video0"
    path.touch()
    with_capture(monkeypatch, capture)
    device = Device(str(path), CameraConfig.model_validate(settings), lambda: capture.now_ns)
    device.open()
    return device


def test_a_camera_is_asked_for_its_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = FakeCapture(pictures=1)
    device = opened_device(tmp_path, monkeypatch, capture, width=1280, height=720, rate_hz=15, pixel_format="MJPG")
    asked = capture.settings
    assert (asked[cv2.CAP_PROP_FRAME_WIDTH], asked[cv2.CAP_PROP_FRAME_HEIGHT], device.rate_hz) == (1280, 720, 15.0)
    assert asked[cv2.CAP_PROP_FOURCC] == cv2.VideoWriter.fourcc(*"MJPG")


def test_a_picture_carries_the_time_of_its_capture_by_the_driver(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = FakeCapture(pictures=3, buffered_ms=120.0)
    device = opened_device(tmp_path, monkeypatch, capture)
    for seq in range(2):
        picture = device.read()
        assert (picture.seq, picture.time_ns) == (seq, capture.now_ns - 170 * MS), "120 ms in the queue and 50 of decoding ago"


def test_decoding_time_is_not_in_the_time_of_a_camera_whose_driver_gives_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    capture = FakeCapture(pictures=2)
    device = opened_device(tmp_path, monkeypatch, capture)
    assert device.read().time_ns == capture.now_ns - 50 * MS


@pytest.mark.parametrize(
    ("buffer_ms", "captured_ms"),
    [
        (9_990.0, 9_990), (8_000.0, 8_000), (10_000.0, 10_000),
        (7_999.0, 10_000), (0.0, 10_000), (10_001.0, 10_000), (1.7e12, 10_000), (-1.0, 10_000), (math.nan, 10_000),
    ],
)  # fmt: skip
def test_a_buffer_time_that_is_not_of_the_last_two_seconds_is_not_believed(buffer_ms: float, captured_ms: int) -> None:
    assert captured_ns(buffer_ms, 10_000 * MS) == captured_ms * MS


def test_a_camera_unplugged_while_it_streams_is_lost_and_given_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = FakeCapture(pictures=2)
    device = opened_device(tmp_path, monkeypatch, capture)
    device.read()
    with pytest.raises(SourceLost, match="stopped giving pictures"):
        device.read()
    (tmp_path / "video0").unlink()
    with pytest.raises(SourceLost, match="is not there"):
        device.read()
    device.close()
    assert capture.released


def test_a_camera_that_opens_but_gives_nothing_is_given_back_before_the_next_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "video0"
    path.touch()
    capture = FakeCapture(pictures=0)
    with_capture(monkeypatch, capture)
    pretend_v4l(monkeypatch, capabilities=0x1, refusal=errno.EBUSY)
    assert "is busy: another program uses it" in open_device(str(path))
    assert capture.released


def test_the_program_that_holds_a_camera_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "video0"
    path.touch()
    pretend_v4l(monkeypatch, capabilities=0x1, refusal=errno.EBUSY)
    with path.open("rb") as file:
        holder = subprocess.Popen(["sleep", "30"], stdin=file)
        try:
            assert f"(sleep, process {holder.pid})" in why_no_pictures(str(path))
        finally:
            holder.kill()
            holder.wait()


def test_a_camera_that_is_not_plugged_in_is_named_and_may_come_back() -> None:
    said = open_device("/dev/video873")
    assert said.startswith("camera '/dev/video873' is not there (not plugged in?)")


def test_a_device_file_that_is_no_camera_is_told_from_a_missing_one() -> None:
    assert open_device("/dev/null") == "camera '/dev/null' is not a camera (it cannot capture video)"


def test_a_device_that_this_user_may_not_open_names_the_group(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    assert "permission denied; is the user in the group 'video'?" in str(why_not_openable("/dev/video0"))


def test_a_camera_that_another_program_uses_is_said_to_be_busy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = tmp_path / "video0"
    device.touch()
    pretend_v4l(monkeypatch, capabilities=0x1, refusal=errno.EBUSY)
    assert why_no_pictures(str(device)).startswith("is busy: another program uses it")


def test_a_camera_that_was_unplugged_meanwhile_is_said_to_be_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = tmp_path / "video0"
    device.touch()
    pretend_v4l(monkeypatch, capabilities=0x1, refusal=errno.ENODEV)
    assert why_no_pictures(str(device)).startswith("is not there")


def test_a_camera_that_is_free_but_silent_is_not_called_busy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = tmp_path / "video0"
    device.touch()
    pretend_v4l(monkeypatch, capabilities=0x1, refusal=None)
    assert why_no_pictures(str(device)) == "is there but gives no picture"
    pretend_v4l(monkeypatch, capabilities=0x2, refusal=None)
    assert "is not a camera" in why_no_pictures(str(device)), "an output device"
