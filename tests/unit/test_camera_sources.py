"""Which reader a source string gets, and what may be shown of it."""

from pathlib import Path

import pytest
from deixis_camera.capture import source_for
from deixis_camera.config import CameraConfig
from deixis_camera.devices import Device
from deixis_camera.folders import Pictures
from deixis_camera.sources import SourceRefused, without_credentials
from deixis_camera.videos import Stream, VideoFile
from pydantic import ValidationError


def kind_of(source: object) -> type:
    return type(source_for(CameraConfig.model_validate({"source": source})))


def test_a_number_is_a_device_also_when_yaml_makes_it_an_integer() -> None:
    assert kind_of(0) is kind_of("0") is kind_of("/dev/video2") is Device
    assert source_for(CameraConfig(source="3")).name == "/dev/video3"


@pytest.mark.parametrize("url", ["rtsp://cam/1", "RTSP://cam/1", "http://cam:8080/video", "https://cam/", "rtsps://cam/"])
def test_a_url_is_a_stream(url: str) -> None:
    assert kind_of(url) is Stream


def test_files_and_folders_are_told_by_what_they_are(tmp_path: Path) -> None:
    film = tmp_path / "film"
    film.write_bytes(b"\x00\x00\x00\x20ftypisom" + bytes(100))
    assert kind_of(str(film)) is VideoFile
    assert kind_of(film.as_uri()) is VideoFile
    assert kind_of(str(tmp_path)) is Pictures
    gif = tmp_path / "wave.gif"
    gif.write_bytes(b"GIF89a" + bytes(100))
    assert kind_of(str(gif)) is VideoFile


@pytest.mark.parametrize("source", ["ftp://host/film.mp4", "concat://a.mp4|b.mp4", "gopro://cam"])
def test_a_url_of_another_scheme_is_refused_with_those_that_work(source: str) -> None:
    with pytest.raises(SourceRefused, match="rtsp://"):
        kind_of(source)


@pytest.mark.parametrize("source", [True, None, 1.5, "", ["0"]])
def test_a_source_that_is_no_text_or_number_is_refused_by_the_settings(source: object) -> None:
    with pytest.raises(ValidationError, match="source"):
        CameraConfig.model_validate({"source": source})


def test_an_unknown_setting_is_refused_by_its_name() -> None:
    with pytest.raises(ValidationError, match="exposure"):
        CameraConfig.model_validate({"exposure": 3})


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("rtsp://admin:s3cret@cam.local:554/h264", "rtsp://cam.local:554/h264"),
        ("http://cam/video?user=admin&pwd=s3cret", "http://cam/video?..."),
        ("rtsp://admin:s3@cr/et@cam/1", "rtsp://cam/1"),
        ("rtsp://admin:s3?cret@cam/1", "rtsp://cam/1?..."),
        ("http://cam:80/v?mail=me@s3cret.org", "http://cam:80/v?..."),
        ("http://[::1]:80/v?mail=me@s3cret.org", "http://[::1]:80/v?..."),
        ("https://u:s3cret@cam/#s3cret", "https://cam/"),
        ("clips/a@b?.mp4", "clips/a@b?.mp4"),
    ],
)
def test_no_credentials_are_left_in_what_is_shown(url: str, shown: str) -> None:
    assert without_credentials(url) == shown
    assert "s3" not in shown
