"""The capture thread: what it hands over, in which order, and when it tries again."""

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_camera import capture as capture_module
from deixis_camera.calibration import AssumedFieldOfView, Calibration, RosCalibration
from deixis_camera.capture import BAD_PICTURES, Capture
from deixis_camera.config import CameraConfig
from deixis_camera.handoff import Became, Handoff, Item, Noted, Opened, Ready, Refused
from deixis_camera.ladder import Rung
from deixis_camera.pictures import Encoded
from deixis_camera.sources import Picture, SourceLost

FIRST_RUN = 7000
GREY = np.full((90, 120, 3), 90, np.uint8)
TINY = np.zeros((10, 10, 3), np.uint8)


class FakeCamera:
    """A live source that plays a script: pictures, and losses in between."""

    name = "fake camera"
    live = True
    rate_hz = 30.0

    def __init__(self, script: list[np.ndarray | str]) -> None:
        self._script = script
        self._seq = 0
        self.opened: list[float] = []
        self.closed = 0

    def open(self) -> None:
        self.opened.append(time.monotonic())
        if self._script and isinstance(self._script[0], str):
            self._script.pop(0)
            raise SourceLost("camera 'fake' is not there")

    def read(self) -> Picture:
        step = self._script.pop(0) if self._script else "unplugged"
        if isinstance(step, str):
            raise SourceLost("camera 'fake' stopped giving pictures")
        self._seq += 1
        return Picture(self._seq - 1, 1000 + self._seq, step)

    def close(self) -> None:
        self.closed += 1


def run(
    config: CameraConfig,
    *,
    until: Callable[[Item], bool],
    calibration: Calibration | None = None,
    lockstep: bool = False,
    quality: int | None = None,
) -> list[Item]:
    """What the thread hands over, up to the first item that `until` accepts."""
    handoff, found = Handoff(), list[Item]()
    thread = Capture(
        config,
        calibration or AssumedFieldOfView(60.0),
        handoff,
        FIRST_RUN,
        rung=lambda: Rung(quality, config.rate_hz or 0.0),
        lockstep=lockstep,
        wake=lambda: None,
        log=logging.getLogger("test"),
    )
    thread.start()
    deadline = time.monotonic() + 10
    done = False
    while not done:
        assert time.monotonic() < deadline, found
        item = handoff.first()
        if item is None:
            time.sleep(0.001)
            continue
        found.append(item)
        handoff.take(item)
        done = until(item)
    thread.stop(5.0)
    assert not thread.is_alive()
    return found


def finished(item: Item) -> bool:
    return isinstance(item, Became) and item.state in ("ended", "failed")


def seqs(items: list[Item]) -> list[int]:
    return [item.seq for item in items if isinstance(item, Ready)]


def runs(items: list[Item]) -> list[int]:
    return [item.run for item in items if isinstance(item, Ready)]


def write_folder(folder: Path, pictures: list[np.ndarray]) -> str:
    folder.mkdir(exist_ok=True)
    for index, picture in enumerate(pictures):
        assert cv2.imwrite(str(folder / f"{index}.png"), picture)
    return str(folder)


def test_a_folder_is_read_to_its_end_and_bad_pictures_are_left_out(tmp_path: Path) -> None:
    source = write_folder(tmp_path / "f", [GREY, TINY, GREY, GREY])
    (tmp_path / "f" / "2.png").write_bytes(b"no picture")
    items = run(CameraConfig(source=source), until=finished)
    assert isinstance(items[0], Opened)
    assert seqs(items) == [0, 3]
    refused = [item.reason for item in items if isinstance(item, Refused)]
    assert ["10 x 10" in refused[0], "2.png" in refused[1], len(refused)] == [True, True, 2]
    assert items[-1] == Became("ended")


def test_a_source_whose_pictures_are_all_too_small_fails_with_the_reason(tmp_path: Path) -> None:
    items = run(CameraConfig(source=write_folder(tmp_path / "f", [TINY, TINY])), until=finished)
    assert isinstance(items[-1], Became)
    assert items[-1].state == "failed"
    assert "none of its 2 pictures can be used: picture of 10 x 10 is smaller" in items[-1].reason


def test_a_calibration_of_another_aspect_ratio_fails_with_both_sizes(tmp_path: Path) -> None:
    ros = RosCalibration("cam.yaml", 640, 360, (500, 0, 320, 0, 500, 180, 0, 0, 1), "none", ())
    items = run(CameraConfig(source=write_folder(tmp_path / "f", [GREY])), until=finished, calibration=ros)
    assert isinstance(items[-1], Became)
    assert items[-1].state == "failed"
    assert "for 640 x 360, the picture has 120 x 90: another aspect ratio" in items[-1].reason


def test_loop_starts_again_at_0_while_time_goes_on(tmp_path: Path) -> None:
    config = CameraConfig(source=write_folder(tmp_path / "f", [GREY] * 3), loop=True)
    count = iter(range(100))
    items = run(config, until=lambda item: isinstance(item, Ready) and next(count) == 6)
    assert seqs(items) == [0, 1, 2, 0, 1, 2, 0]
    times = [item.time_ns for item in items if isinstance(item, Ready)]
    assert times == [i * 200_000_000 for i in range(7)]
    assert runs(items) == [FIRST_RUN + number for number in (0, 0, 0, 1, 1, 1, 2)], "each pass is a run of its own"


def test_a_rate_limit_keeps_the_index_of_the_frames_it_lets_through(tmp_path: Path) -> None:
    path = tmp_path / "film.mp4"
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"mp4v"), 30.0, (160, 120))
    for _ in range(12):
        writer.write(np.zeros((120, 160, 3), np.uint8))
    writer.release()
    items = run(CameraConfig(source=str(path), rate_hz=10), until=finished)
    assert seqs(items) == [0, 3, 6, 9]


def test_a_large_picture_is_scaled_and_said_once(tmp_path: Path) -> None:
    big = np.full((1080, 1920, 3), 60, np.uint8)
    items = run(CameraConfig(source=write_folder(tmp_path / "f", [big, big]), max_width=640), until=finished)
    assert [item.text for item in items if isinstance(item, Noted)] == ["pictures of 1920 x 1080 are scaled down to 640 x 360"]
    ready = next(item for item in items if isinstance(item, Ready))
    assert (ready.encoded.width, ready.encoded.height) == (640, 360)
    assert ready.intrinsics.camera_matrix[2] == 319.5


def test_a_missing_file_is_a_final_failure(tmp_path: Path) -> None:
    items = run(CameraConfig(source=str(tmp_path / "film.mp4")), until=finished)
    assert items == [Became("failed", f"file '{tmp_path / 'film.mp4'}' does not exist")]


def test_a_lost_camera_is_tried_again_with_growing_pauses_and_its_count_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    camera = FakeCamera([GREY, "unplugged", "not there", "not there", GREY])
    monkeypatch.setattr(capture_module, "source_for", lambda *_: camera)
    config = CameraConfig(retry_first_s=0.05, retry_longest_s=0.1)
    items = run(config, until=lambda item: isinstance(item, Ready) and item.seq == 1)
    states = [item.state for item in items if isinstance(item, Became)]
    assert states == ["retrying", "retrying", "retrying"]
    pauses = np.diff(camera.opened)
    assert pauses[0] >= 0.05
    assert pauses[1:3].min() >= 0.1
    assert camera.closed >= 3, "a lost device is given back before the next try"
    assert (runs(items), seqs(items)) == ([FIRST_RUN] * 2, [0, 1]), "it goes on in its run"


class FakeWebFilm(FakeCamera):
    """A film on a web server: each opening begins at its first picture."""

    name = "fake film"
    live = False

    def open(self) -> None:
        super().open()
        self._seq = 0


def test_a_film_that_is_lost_and_opened_again_starts_at_0_in_a_new_run(monkeypatch: pytest.MonkeyPatch) -> None:
    film = FakeWebFilm([GREY, GREY, "lost", "not there", GREY])
    monkeypatch.setattr(capture_module, "source_for", lambda *_: film)
    config = CameraConfig(retry_first_s=0.01, retry_longest_s=0.01)
    items = run(config, until=lambda item: isinstance(item, Ready) and item.run > FIRST_RUN)
    assert (runs(items), seqs(items)) == ([FIRST_RUN, FIRST_RUN, FIRST_RUN + 1], [0, 1, 0])
    times = [item.time_ns for item in items if isinstance(item, Ready)]
    assert times == sorted(set(times)), "time goes on"


def test_a_live_camera_that_only_gives_useless_pictures_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture_module, "source_for", lambda *_: FakeCamera([TINY] * (BAD_PICTURES + 5)))
    items = run(CameraConfig(), until=finished)
    assert isinstance(items[-1], Became)
    assert (items[-1].state, f"{BAD_PICTURES} pictures in a row" in items[-1].reason) == ("failed", True)


def test_lockstep_refuses_a_live_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture_module, "source_for", lambda *_: FakeCamera([GREY]))
    items = run(CameraConfig(), until=finished, lockstep=True)
    assert items[-1] == Became("failed", "'fake camera' is live: lockstep needs a file or a folder of pictures")


def test_a_fault_in_the_reader_is_said_and_not_swallowed(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fault(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(capture_module, "source_for", fault)
    items = run(CameraConfig(), until=finished)
    assert items == [Became("failed", "internal error while reading: ZeroDivisionError")]
    assert "the capture thread ended" in caplog.text


def ready(seq: int) -> Ready:
    return Ready(FIRST_RUN, seq, seq, Encoded(1, 1, "mono8", b"x"), AssumedFieldOfView(60).for_size(64, 64))


def test_of_live_pictures_the_newest_replaces_the_one_that_was_not_fetched_and_reports_stay() -> None:
    handoff = Handoff()
    handoff.report(Opened(True, 30.0))
    for seq in range(5):
        handoff.put_live(ready(seq))
    handoff.report(Became("retrying"))
    items = []
    while (item := handoff.first()) is not None:
        items.append(item)
        handoff.take(item)
    assert [type(item) for item in items] == [Opened, Ready, Became]
    assert seqs(items) == [4]
    assert (handoff.take_overwritten(), handoff.take_overwritten()) == (4, 0)


def test_recorded_pictures_wait_for_room_and_none_is_lost() -> None:
    handoff = Handoff(depth=2)
    writer = threading.Thread(target=lambda: [handoff.put_recorded(ready(seq)) for seq in range(20)])
    writer.start()
    fetched: list[int] = []
    while len(fetched) < 20:
        item = handoff.first()
        if isinstance(item, Ready):
            assert handoff.waiting_pictures() <= 2
            fetched.append(item.seq)
            handoff.take(item)
    writer.join(5)
    assert fetched == list(range(20))


def test_a_writer_that_waits_for_room_returns_when_the_reader_goes() -> None:
    handoff = Handoff(depth=1)
    handoff.put_recorded(ready(0))
    writer = threading.Thread(target=lambda: handoff.put_recorded(ready(1)))
    writer.start()
    handoff.close()
    writer.join(5)
    assert not writer.is_alive()
    assert handoff.waiting_pictures() == 1


def test_a_live_picture_that_comes_while_the_last_goes_out_is_not_lost() -> None:
    handoff = Handoff()
    first, second = ready(0), ready(1)
    handoff.put_live(first)
    assert handoff.first() is first
    handoff.put_live(second)
    assert not handoff.take(first), "it was replaced"
    assert handoff.first() is second
    assert handoff.take(second)
    handoff.put_live(ready(2))
    assert handoff.take_overwritten() == 1, "one that was taken is not counted as replaced"
