"""Streams over loopback: good ones, and servers that refuse, hang or send something else."""

import contextlib
import functools
import http.server
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from deixis_camera import videos
from deixis_camera.config import CameraConfig
from deixis_camera.sources import SourceLost, SourceRefused
from deixis_camera.videos import Stream

CONFIG = CameraConfig(open_timeout_s=3, read_timeout_s=1)


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


@contextlib.contextmanager
def serving(handler: Callable[..., http.server.BaseHTTPRequestHandler]) -> Iterator[int]:
    """A web server on loopback; gives its port."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        server.server_close()


@contextlib.contextmanager
def answering(reply: bytes | None) -> Iterator[int]:
    """A TCP server on loopback that sends `reply` to whatever comes, or nothing at all; gives its port."""
    listener = socket.create_server(("127.0.0.1", 0))
    done = threading.Event()

    def accept() -> None:
        held = []
        with contextlib.suppress(OSError):
            while not done.is_set():
                connection, _ = listener.accept()
                if reply is None:
                    held.append(connection)
                    continue
                connection.recv(4096)
                connection.sendall(reply)
                connection.close()

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    try:
        yield listener.getsockname()[1]
    finally:
        done.set()
        listener.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def mjpeg_handler(pictures: int, hang: threading.Event | None = None) -> type[http.server.BaseHTTPRequestHandler]:
    """An IP camera: pictures as multipart/x-mixed-replace; then the end, or silence until `hang` is set."""

    class Camera(Quiet):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
            self.end_headers()
            for index in range(pictures):
                good, data = cv2.imencode(".jpg", np.full((120, 160, 3), 10 * index, np.uint8))
                assert good
                with contextlib.suppress(OSError):
                    head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
                    self.wfile.write(head.encode() + data.tobytes() + b"\r\n")
            if hang is not None:
                hang.wait(10)

    return Camera


def why_lost(url: str) -> str:
    with pytest.raises(SourceLost) as loss:
        Stream(url, CONFIG, lambda: 0).open()
    return str(loss.value)


def read_until_lost(stream: Stream) -> tuple[list[int], str]:
    """`seq` of the pictures that came, and what was said of the loss."""
    seqs = []
    try:
        while (picture := stream.read()) is not None:
            seqs.append(picture.seq)
    except SourceLost as error:
        return seqs, str(error)
    return seqs, ""


def write_film(path: Path) -> None:
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"mp4v"), 25.0, (160, 120))
    for index in range(10):
        writer.write(np.full((120, 160, 3), 20 * index, np.uint8))
    writer.release()


def test_a_film_on_a_web_server_is_a_recording_with_media_time(tmp_path: Path) -> None:
    write_film(tmp_path / "film.mp4")
    with serving(functools.partial(Quiet, directory=str(tmp_path))) as port:
        stream = Stream(f"http://127.0.0.1:{port}/film.mp4", CONFIG, lambda: 0)
        stream.open()
        pictures = []
        while (picture := stream.read()) is not None:
            pictures.append(picture)
        stream.close()
    assert not stream.live
    assert [(picture.seq, picture.time_ns) for picture in pictures] == [(i, i * 40_000_000) for i in range(10)]


def test_an_ip_camera_is_live_and_its_pictures_carry_the_time_of_their_arrival() -> None:
    times = iter(range(1000, 2000))
    with serving(mjpeg_handler(8)) as port:
        stream = Stream(f"http://127.0.0.1:{port}/video", CONFIG, lambda: next(times))
        stream.open()
        pictures = [stream.read() for _ in range(5)]
        stream.close()
    assert stream.live
    assert [(p.seq, p.time_ns) for p in pictures if p is not None] == [(i, 1000 + i) for i in range(5)]


def test_the_conversion_of_a_picture_is_not_in_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now_ns=0)

    class SlowCapture:
        """Holds a capture: OpenCV's own type, when it is subclassed, tears the heap (segfaults in later tests)."""

        def __init__(self, *arguments: Any) -> None:
            self._capture = cv2.VideoCapture(*arguments)

        def __getattr__(self, name: str) -> Any:
            return getattr(self._capture, name)

        def retrieve(self, *arguments: Any) -> Any:
            clock.now_ns += 50_000_000
            return self._capture.retrieve(*arguments)

    monkeypatch.setattr(videos, "cv2", SimpleNamespace(**vars(cv2) | {"VideoCapture": SlowCapture}))
    with serving(mjpeg_handler(8)) as port:
        stream = Stream(f"http://127.0.0.1:{port}/video", CONFIG, lambda: clock.now_ns)
        stream.open()
        pictures = [stream.read() for _ in range(3)]
        stream.close()
    assert [p.time_ns for p in pictures if p is not None] == [0, 50_000_000, 100_000_000]


def test_a_stream_that_ends_is_lost_and_counts_on_when_it_comes_back() -> None:
    with serving(mjpeg_handler(6)) as port:
        stream = Stream(f"http://127.0.0.1:{port}/video", CONFIG, lambda: 0)
        last = -1
        for _ in range(2):
            stream.open()
            seqs, said = read_until_lost(stream)
            assert "ended, or gave no picture" in said
            assert seqs == list(range(last + 1, last + 1 + len(seqs)))
            last = seqs[-1]
            stream.close()
    assert last >= 8


def test_a_stream_that_falls_silent_is_lost_after_the_read_timeout() -> None:
    over = threading.Event()
    with serving(mjpeg_handler(8, over)) as port:
        stream = Stream(f"http://127.0.0.1:{port}/video", CONFIG, lambda: 0)
        stream.open()
        seqs, said = read_until_lost(stream)
        over.set()
        stream.close()
    assert len(seqs) >= 6
    assert "gave no picture for 1 s" in said


@pytest.mark.parametrize("scheme", ["http", "rtsp"])
def test_a_server_that_is_not_there_is_named_with_its_port(scheme: str) -> None:
    port = free_port()
    said = why_lost(f"{scheme}://user:s3cret@127.0.0.1:{port}/video")
    assert said == (
        f"stream '{scheme}://127.0.0.1:{port}/video' is not reached: nothing listens at 127.0.0.1:{port} (connection refused)"
    )


def test_a_path_that_the_server_does_not_know_is_said(tmp_path: Path) -> None:
    with serving(functools.partial(Quiet, directory=str(tmp_path))) as port:
        assert "the server knows no such path (404)" in why_lost(f"http://127.0.0.1:{port}/film.mp4?key=s3cret")


def test_a_page_that_is_no_video_is_said(tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text("<html>no camera</html>" * 100)
    with serving(functools.partial(Quiet, directory=str(tmp_path))) as port:
        assert "what it sends is not a video" in why_lost(f"http://127.0.0.1:{port}/page.html")


@pytest.mark.parametrize(
    ("reply", "cause"),
    [
        (b"RTSP/1.0 404 Not Found\r\nCSeq: 1\r\n\r\n", "no such path (404)"),
        (b"RTSP/1.0 401 Unauthorized\r\nCSeq: 1\r\n\r\n", "it asks for a password"),
        (b"SSH-2.0-OpenSSH_9.2\r\n", "does not speak RTSP"),
    ],
)
def test_an_rtsp_server_that_refuses_is_quoted(reply: bytes, cause: str) -> None:
    with answering(reply) as port:
        assert cause in why_lost(f"rtsp://127.0.0.1:{port}/1")


def test_a_wrong_password_is_said_without_the_password() -> None:
    with answering(b"RTSP/1.0 401 Unauthorized\r\nCSeq: 1\r\n\r\n") as port:
        said = why_lost(f"rtsp://admin:s3cret@127.0.0.1:{port}/1")
    assert "wrong user or password" in said
    assert "s3cret" not in said
    assert "admin" not in said


def test_a_server_that_accepts_and_says_nothing_is_given_up_in_time() -> None:
    with answering(None) as port:
        assert "does not answer" in why_lost(f"rtsp://127.0.0.1:{port}/1")


@pytest.mark.parametrize("url", ["http://", "rtsp:///path", "http://host:99999/", "rtsp://u:p/w@host/1"])
def test_a_url_without_a_host_is_a_final_error(url: str) -> None:
    with pytest.raises(SourceRefused, match="not a URL with a host"):
        Stream(url, CONFIG, lambda: 0).open()
