"""Video files and GIFs: what is read, and what is said of a file that is not one."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_camera.config import CameraConfig
from deixis_camera.diagnosis import video_format
from deixis_camera.sources import SourceBroken, SourceRefused
from deixis_camera.videos import VideoFile


def write_video(path: Path, frames: int = 12, size: tuple[int, int] = (160, 120), rate_hz: float = 30.0) -> Path:
    """A film whose frame i is grey with level 10 + 10 i."""
    backend, code = (cv2.CAP_OPENCV_MJPEG, "MJPG") if path.suffix == ".avi" else (cv2.CAP_FFMPEG, "mp4v")
    writer = cv2.VideoWriter(str(path), backend, cv2.VideoWriter.fourcc(*code), rate_hz, size)
    assert writer.isOpened()
    for index in range(frames):
        writer.write(np.full((size[1], size[0], 3), 10 + 10 * (index % 24), np.uint8))
    writer.release()
    return path


def video_file(path: Path) -> VideoFile:
    return VideoFile(path, CameraConfig())


def read_all(file: VideoFile) -> tuple[list[tuple[int, int, float]], str]:
    """(seq, time_ns, mean level) of each frame, and what was said at the end."""
    frames: list[tuple[int, int, float]] = []
    file.open()
    try:
        while (picture := file.read()) is not None:
            frames.append((picture.seq, picture.time_ns, float(picture.image.mean())))
    except SourceBroken as error:
        return frames, str(error)
    finally:
        file.close()
    return frames, ""


@pytest.mark.parametrize("suffix", [".mp4", ".avi", ".mkv", ".mov"])
def test_a_video_gives_every_frame_with_its_index_and_media_time(tmp_path: Path, suffix: str) -> None:
    frames, said = read_all(video_file(write_video(tmp_path / f"film{suffix}")))
    assert [seq for seq, _, _ in frames] == list(range(12))
    assert [time_ns for _, time_ns, _ in frames] == pytest.approx([i * 1e9 / 30 for i in range(12)], abs=1e6)
    assert [level for _, _, level in frames] == pytest.approx([10 + 10 * i for i in range(12)], abs=4)
    assert said == ""


def test_a_file_opened_again_starts_at_its_first_frame(tmp_path: Path) -> None:
    file = video_file(write_video(tmp_path / "film.mp4"))
    assert read_all(file) == read_all(file)


def test_a_gif_keeps_the_pause_of_each_picture(tmp_path: Path) -> None:
    animation = cv2.Animation()
    animation.frames = [np.full((80, 100, 4), 40 * i, np.uint8) for i in range(1, 6)]
    animation.durations = [100, 200, 50, 100, 100]
    path = tmp_path / "wave.gif"
    assert cv2.imwriteanimation(str(path), animation)
    frames, said = read_all(video_file(path))
    assert [time_ns // 1_000_000 for _, time_ns, _ in frames] == [0, 100, 300, 350, 450]
    assert said == ""


@pytest.mark.parametrize(
    ("name", "content", "cause"),
    [
        ("empty.mp4", b"", "is empty"),
        ("notes.txt", b"a text that FFmpeg plays as a film of a terminal\n" * 100, "is not a video: it holds text"),
        ("named.mp4", b"not a video at all\n" * 100, "is not a video: it holds text"),
        ("noise.mp4", np.random.default_rng(0).bytes(100_000), "is not a video: its content is of no known video format"),
        ("noise.bin", np.random.default_rng(0).bytes(100_000), "is not a video: its content is of no known video format"),
        ("head.avi", b"RIFF\x00\x00\x00\x00AVI " + bytes(2000), "cannot be decoded: it is damaged"),
    ],
)
def test_a_file_without_a_video_is_refused_with_its_name_and_the_cause(
    tmp_path: Path, name: str, content: bytes, cause: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(SourceRefused) as refusal:
        video_file(path).open()
    assert str(path) in str(refusal.value)
    assert cause in str(refusal.value)


def test_a_missing_file_is_told_from_a_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(SourceRefused, match=r"does not exist$"):
        video_file(tmp_path / "film.mp4").open()
    with pytest.raises(SourceRefused, match="nor does its folder"):
        video_file(tmp_path / "clips" / "film.mp4").open()


def test_a_film_cut_off_in_the_middle_plays_to_the_cut_and_says_so(tmp_path: Path) -> None:
    whole = write_video(tmp_path / "whole.avi", frames=30).read_bytes()
    cut = tmp_path / "cut.avi"
    cut.write_bytes(whole[: len(whole) * 6 // 10])
    frames, said = read_all(video_file(cut))
    assert 10 <= len(frames) < 25
    assert said == f"video file '{cut}' is cut off or damaged: {len(frames)} of about 30 frames could be read"


def test_an_mp4_without_its_index_is_said_to_be_cut_off(tmp_path: Path) -> None:
    whole = write_video(tmp_path / "whole.mp4", frames=30).read_bytes()
    cut = tmp_path / "cut.mp4"
    cut.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(SourceRefused, match=r"cut off \(its index, the 'moov' atom, is missing\)"):
        video_file(cut).open()


def test_the_format_is_told_by_the_first_bytes_and_not_by_the_name() -> None:
    assert video_format(b"\x00\x00\x00\x20ftypisom" + bytes(8)) == "mp4"
    assert video_format(b"\x1a\x45\xdf\xa3" + bytes(8)) == "matroska"
    assert video_format(b"\x47" + bytes(187) + b"\x47" + bytes(20)) == "mpegts"
    assert video_format(b"\x89PNG\r\n") is None
    assert video_format(b"") is None
