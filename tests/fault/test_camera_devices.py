"""Cameras that are missing, busy, not permitted or no cameras."""

import errno
import fcntl
import os
import struct
from pathlib import Path

import pytest
from deixis_camera.config import CameraConfig
from deixis_camera.devices import VIDIOC_QUERYCAP, VIDIOC_REQBUFS, Device, why_no_pictures, why_not_openable
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
