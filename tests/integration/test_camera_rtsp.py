"""RTSP, against a server of our own on loopback that speaks enough of it (RFC 2326) to be a network camera."""

import base64
import contextlib
import os
import socket
import struct
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_camera.config import CameraConfig
from deixis_camera.sources import SourceLost
from deixis_camera.videos import Stream

FRAMES = 50
RATE_HZ = 25.0
TS_PACKETS = 7 * 188


def transport_stream(path: Path) -> bytes:
    """A film as an MPEG transport stream; frame i is grey with level 4 i."""
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"mpg2"), RATE_HZ, (160, 120))
    assert writer.isOpened()
    for index in range(FRAMES):
        writer.write(np.full((120, 160, 3), 4 * index, np.uint8))
    writer.release()
    return path.read_bytes()


class RtspServer:
    """Sends a transport stream as RTP (RFC 2250, payload type 33) inside the RTSP connection, at the film's rate."""

    def __init__(self, film: bytes, user: str = "") -> None:
        self._film = film
        self._wanted = "Basic " + base64.b64encode(user.encode()).decode() if user else ""
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._over = threading.Event()
        self.port = int(self._listener.getsockname()[1])
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self._over.set()
        self._listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while not self._over.is_set():
                connection, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with contextlib.suppress(OSError), connection, connection.makefile("rb") as requests:
            while line := requests.readline().split():
                headers = {}
                while (header := requests.readline().strip()) and b":" in header:
                    name, _, value = header.partition(b":")
                    headers[name.strip().lower()] = value.strip().decode()
                connection.sendall(self._answer(line[0].decode(), line[1].decode(), headers))
                if line[0] == b"PLAY":
                    self._play(connection)
                    return

    def _answer(self, method: str, url: str, headers: dict[bytes, str]) -> bytes:
        sequence = headers.get(b"cseq", "0")
        if self._wanted and headers.get(b"authorization") != self._wanted:
            return f'RTSP/1.0 401 Unauthorized\r\nCSeq: {sequence}\r\nWWW-Authenticate: Basic realm="camera"\r\n\r\n'.encode()
        body, extra = "", ""
        if method == "OPTIONS":
            extra = "Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN\r\n"
        elif method == "DESCRIBE":
            body = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=camera\r\nt=0 0\r\nm=video 0 RTP/AVP 33\r\na=control:track1\r\n"
            extra = f"Content-Base: {url}/\r\nContent-Type: application/sdp\r\nContent-Length: {len(body)}\r\n"
        elif method == "SETUP":
            extra = "Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\nSession: 1\r\n"
        elif method == "PLAY":
            extra = "Session: 1\r\n"
        return f"RTSP/1.0 200 OK\r\nCSeq: {sequence}\r\n{extra}\r\n{body}".encode()

    def _play(self, connection: socket.socket) -> None:
        chunks = [self._film[at : at + TS_PACKETS] for at in range(0, len(self._film), TS_PACKETS)]
        began = time.monotonic()
        for index, chunk in enumerate(chunks):
            due = FRAMES / RATE_HZ * index / len(chunks)
            self._over.wait(max(0.0, due - (time.monotonic() - began)))
            rtp = struct.pack(">BBHII", 0x80, 33, index & 0xFFFF, int(due * 90_000), 1) + chunk
            connection.sendall(struct.pack(">cBH", b"$", 0, len(rtp)) + rtp)


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return transport_stream(tmp_path_factory.mktemp("film") / "film.ts")


@pytest.fixture
def server(film: bytes) -> Iterator[RtspServer]:
    server = RtspServer(film, user="admin:s3cret/x")
    yield server
    server.close()


def opened(url: str) -> Stream:
    stream = Stream(url, CameraConfig(open_timeout_s=5, read_timeout_s=1))
    stream.open()
    return stream


def test_an_rtsp_camera_with_a_password_is_read_live_and_in_order(server: RtspServer) -> None:
    stream = opened(f"rtsp://admin:s3cret%2Fx@127.0.0.1:{server.port}/h264")
    levels: list[float] = []
    stamps: list[int] = []
    with pytest.raises(SourceLost, match=rf"stream 'rtsp://127.0.0.1:{server.port}/h264' ended, or gave no picture"):
        read_to_the_end(stream, levels, stamps)
    stream.close()
    assert stream.live
    assert "OPENCV_FFMPEG_CAPTURE_OPTIONS" not in os.environ, "a file opened later would lose its last frame"
    assert len(levels) >= 15, "those sent while FFmpeg looks at the stream are skipped"
    assert levels == sorted(levels)
    assert (stamps[-1] - stamps[0]) / 1e9 == pytest.approx((len(stamps) - 1) / RATE_HZ, abs=0.4), "in its own time"


def read_to_the_end(stream: Stream, levels: list[float], stamps: list[int]) -> None:
    while (picture := stream.read()) is not None:
        levels.append(float(np.mean(picture.image)))
        stamps.append(picture.time_ns)


def test_an_rtsp_camera_that_wants_another_password_is_said_to(server: RtspServer) -> None:
    with pytest.raises(SourceLost, match=r"refused by the server \(401\): wrong user or password") as loss:
        opened(f"rtsp://admin:wr0ng@127.0.0.1:{server.port}/h264")
    assert "wr0ng" not in str(loss.value)
