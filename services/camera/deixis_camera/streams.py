"""Pictures over the network: RTSP and HTTP URLs."""

from __future__ import annotations

import base64
import contextlib
import http.client
import os
import socket
import ssl
from collections.abc import Callable, Iterator
from urllib.parse import SplitResult, unquote, urlsplit

from .config import CameraConfig
from .decoder import Decoder
from .sources import Picture, SourceBroken, SourceLost, SourceRefused, without_credentials

PORTS = {"http": 80, "https": 443, "rtsp": 554, "rtsps": 322}
PROBE_TIMEOUT_S = 2.0
FFMPEG_OPTIONS = "OPENCV_FFMPEG_CAPTURE_OPTIONS"
RTSP_OPTIONS = "rtsp_transport;tcp|fflags;nobuffer|flags;low_delay"
"""Over TCP: no torn pictures. FFmpeg looks at a stream for about a second before it gives the first picture; without
`nobuffer` the pictures of that second follow in a burst, old but stamped as new."""
MISSING_SHARE = 0.02


class Stream:
    """An RTSP or HTTP URL. A film of known length on a web server is a recording, played at its own rate; all else is live."""

    def __init__(self, url: str, config: CameraConfig, now_ns: Callable[[], int]) -> None:
        self._url = url
        self._config = config
        self._now_ns = now_ns
        self._decoder: Decoder | None = None
        self._seq = 0
        self._expected = 0
        self.name = without_credentials(url)
        self.live = True
        self.rate_hz = 0.0

    def open(self) -> None:
        """Connect. Raises SourceLost with the cause, SourceRefused for a URL that names no host."""
        self.close()
        parts = _split(self._url, self.name)
        config = self._config
        try:
            with _ffmpeg_options(RTSP_OPTIONS if parts.scheme.startswith("rtsp") else ""):
                self._decoder = Decoder(
                    self._url,
                    open_timeout_s=config.open_timeout_s,
                    read_timeout_s=config.read_timeout_s,
                    threads=config.decoder_threads,
                )
        except OSError:
            raise SourceLost(f"stream '{self.name}' {why_no_stream(parts)}") from None
        self._expected = self._decoder.expected_frames
        self.live = self._expected == 0
        # Over HTTP a live stream does not say its rate, and FFmpeg then makes up 25.
        self.rate_hz = 0.0 if self.live and parts.scheme.startswith("http") else self._decoder.rate_hz
        if not self.live:
            self._seq = 0

    def read(self) -> Picture | None:
        """The next picture; None at the end of a recording. Raises SourceLost, or SourceBroken for a recording."""
        image = self._decoder.read() if self._decoder is not None else None
        if self._decoder is None or image is None:
            self._refuse_early_end()
            return None
        time_ns = self._now_ns() if self.live else self._decoder.media_ns()
        picture = Picture(seq=self._seq, time_ns=time_ns, image=image)
        self._seq += 1
        return picture

    def close(self) -> None:
        """Disconnect."""
        if self._decoder is not None:
            self._decoder.close()
            self._decoder = None

    def _refuse_early_end(self) -> None:
        if self.live:
            raise SourceLost(f"stream '{self.name}' ended, or gave no picture for {self._config.read_timeout_s:g} s")
        if self._expected - self._seq > max(1.0, MISSING_SHARE * self._expected):
            raise SourceBroken(f"stream '{self.name}' broke off: {self._seq} of about {self._expected} frames came")


@contextlib.contextmanager
def _ffmpeg_options(options: str) -> Iterator[None]:
    """Have OpenCV open a video with these FFmpeg options, unless the user has set others.

    OpenCV takes them from the environment alone. They are taken back: a file opened with them loses its last frame.
    """
    if not options or FFMPEG_OPTIONS in os.environ:
        yield
        return
    os.environ[FFMPEG_OPTIONS] = options
    try:
        yield
    finally:
        os.environ.pop(FFMPEG_OPTIONS, None)


def why_no_stream(parts: SplitResult) -> str:
    """Why a URL gives no video, to follow its name in a sentence: asks the server once more, with a short time limit."""
    host, port = parts.hostname or "", parts.port or PORTS[parts.scheme]
    try:
        status = _ask_http(parts, host, port) if parts.scheme.startswith("http") else _ask_rtsp(parts, host, port)
    except socket.gaierror:
        return f"is not reached: the name '{host}' is not known"
    except ConnectionRefusedError:
        return f"is not reached: nothing listens at {host}:{port} (connection refused)"
    except TimeoutError:
        return f"does not answer: no answer from {host}:{port} within {PROBE_TIMEOUT_S:g} s"
    except ssl.SSLCertVerificationError as error:
        return f"is not trusted: {error.verify_message}"
    except (OSError, http.client.HTTPException, ValueError) as error:
        return f"is not reached at {host}:{port}: {_plain(error)}"
    return _say(status, parts)


def _say(status: int, parts: SplitResult) -> str:
    if status in (401, 403):
        return f"is refused by the server ({status}): " + (
            "wrong user or password" if parts.username else "it asks for a password"
        )
    if status == 404:
        return "is not there: the server knows no such path (404)"
    if status >= 400:
        return f"is refused by the server (status {status})"
    return "is answered by the server, but what it sends is not a video"


def _ask_http(parts: SplitResult, host: str, port: int) -> int:
    """Status of a GET. Raises OSError or http.client.HTTPException."""
    kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
    connection = kind(host, port, timeout=PROBE_TIMEOUT_S)
    try:
        target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        connection.request("GET", target, headers=_basic_authorisation(parts))
        return connection.getresponse().status
    finally:
        connection.close()


def _ask_rtsp(parts: SplitResult, host: str, port: int) -> int:
    """Status of a DESCRIBE (RFC 2326, 10.2). Raises OSError, or ValueError where the answer is not RTSP."""
    with socket.create_connection((host, port), timeout=PROBE_TIMEOUT_S) as plain:
        connection: socket.socket = plain
        if parts.scheme == "rtsps":
            connection = ssl.create_default_context().wrap_socket(plain, server_hostname=host)
        headers = "".join(f"{name}: {value}\r\n" for name, value in _basic_authorisation(parts).items())
        url = f"{parts.scheme}://{host}:{port}{parts.path}" + (f"?{parts.query}" if parts.query else "")
        connection.sendall(f"DESCRIBE {url} RTSP/1.0\r\nCSeq: 1\r\n{headers}\r\n".encode())
        answer = connection.recv(256).split()
    if len(answer) < 2 or not answer[0].startswith(b"RTSP/") or not answer[1].isdigit():
        raise ValueError("what answers there does not speak RTSP")
    return int(answer[1])


def _basic_authorisation(parts: SplitResult) -> dict[str, str]:
    if not parts.username:
        return {}
    pair = f"{unquote(parts.username)}:{unquote(parts.password or '')}".encode()
    return {"Authorization": "Basic " + base64.b64encode(pair).decode()}


def _split(url: str, name: str) -> SplitResult:
    try:
        parts = urlsplit(url)
        known = bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:
        known = False
    if not known:
        raise SourceRefused(f"'{name}' is not a URL with a host (special characters in a password are written as %XX)")
    return parts


def _plain(error: Exception) -> str:
    # Only what carries no URL: the texts of http.client's exceptions quote the request.
    if isinstance(error, OSError):
        return error.strerror or type(error).__name__
    return str(error) if type(error) is ValueError else f"unintelligible answer ({type(error).__name__})"
