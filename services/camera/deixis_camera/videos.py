"""What FFmpeg reads: video files, animated GIFs, and RTSP and HTTP URLs."""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import SplitResult, urlsplit

import cv2

from .config import CameraConfig
from .diagnosis import refuse_non_video, refuse_unreadable, why_no_video
from .sources import Image, Picture, SourceBroken, SourceLost, SourceRefused, without_credentials
from .stream_diagnosis import why_no_stream

LONGEST_STEP_NS = 60_000_000_000
"""A jump of media time beyond this is a damaged time stamp, not a pause in the film."""
MISSING_SHARE = 0.02
"""Containers state the number of frames to within a few; more missing than this share means that the film is cut off."""
FFMPEG_OPTIONS = "OPENCV_FFMPEG_CAPTURE_OPTIONS"
RTSP_OPTIONS = "rtsp_transport;tcp|fflags;nobuffer|flags;low_delay"
"""Over TCP: no torn pictures. FFmpeg looks at a stream for about a second before it gives the first picture; without
`nobuffer` the pictures of that second follow in a burst, old but stamped as new."""


class Decoder:
    """One opened video: its pictures with their times, within the time limits of the settings.

    expected: frames by the container; 0 where it does not say, as with a live stream.
    rate_hz: frames per second by the container; 0 where it does not say anything sensible.
    grabbed_ns: monotonic time at which the picture read last was there.
    Raises OSError when OpenCV cannot open `location`.
    """

    def __init__(self, location: str, config: CameraConfig, clock_ns: Callable[[], int]) -> None:
        settings = [
            cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(config.open_timeout_s * 1000),
            cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(config.read_timeout_s * 1000),
            cv2.CAP_PROP_N_THREADS, config.decoder_threads,
        ]  # fmt: skip
        self._capture = cv2.VideoCapture(location, cv2.CAP_FFMPEG, settings)
        if not self._capture.isOpened():
            self._capture.release()
            raise OSError("OpenCV with FFmpeg cannot open it")
        self._clock_ns = clock_ns
        self._last_ns = -1
        self._first_ns: int | None = None
        count, rate = self._capture.get(cv2.CAP_PROP_FRAME_COUNT), self._capture.get(cv2.CAP_PROP_FPS)
        self.expected = int(count) if math.isfinite(count) and 0 < count < 2**53 else 0
        self.rate_hz = float(rate) if math.isfinite(rate) and 0 < rate <= 240 else 0.0
        self.grabbed_ns = 0

    def read(self) -> Image | None:
        """The next picture, None when there is none."""
        if not self._capture.grab():
            return None
        self.grabbed_ns = self._clock_ns()
        good, image = self._capture.retrieve()
        return image if good else None

    def media_ns(self) -> int:
        """Media time of the picture read last, from that of the first; grows from picture to picture.

        The container's time stamps are used (a GIF has a pause per picture); a stamp that does not advance, or that jumps, is
        replaced by one frame's time after the last.
        """
        stamp = round(self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6)
        if self._first_ns is None:
            self._first_ns = stamp
        time_ns = stamp - self._first_ns
        if not self._last_ns < time_ns <= self._last_ns + LONGEST_STEP_NS:
            time_ns = self._last_ns + round(1e9 / (self.rate_hz or 25.0)) if self._last_ns >= 0 else 0
        self._last_ns = time_ns
        return time_ns

    def close(self) -> None:
        """Let go of the file or connection."""
        self._capture.release()


class Video:
    """Pictures from a Decoder, numbered; a recording is to have about as many as its container says."""

    broken: str

    def __init__(self, name: str, config: CameraConfig, clock_ns: Callable[[], int], live: bool) -> None:
        self._config = config
        self._clock_ns = clock_ns
        self._decoder: Decoder | None = None
        self._seq = 0
        self.name = name
        self.live = live
        self.rate_hz = 0.0

    @property
    def expected(self) -> int:
        """Pictures of the recording that is open, by its container; 0 where that does not say."""
        return self._decoder.expected if self._decoder is not None else 0

    def read(self) -> Picture | None:
        """The next picture; None at the end of a recording. Raises SourceLost, or SourceBroken for a recording."""
        decoder = self._decoder
        if decoder is None:
            raise SourceLost(f"'{self.name}' is not open")
        image = decoder.read()
        if image is None:
            self._refuse_early_end(decoder.expected)
            return None
        picture = Picture(seq=self._seq, time_ns=decoder.grabbed_ns if self.live else decoder.media_ns(), image=image)
        self._seq += 1
        return picture

    def close(self) -> None:
        """Close the file, or the connection."""
        if self._decoder is not None:
            self._decoder.close()
            self._decoder = None

    def _refuse_early_end(self, expected: int) -> None:
        if self.live:
            raise SourceLost(f"stream '{self.name}' ended, or gave no picture for {self._config.read_timeout_s:g} s")
        if expected - self._seq > max(1.0, MISSING_SHARE * expected):
            raise SourceBroken(self.broken.format(name=self.name, seq=self._seq, expected=expected))


class VideoFile(Video):
    """A video file or animated GIF."""

    broken = "video file '{name}' is cut off or damaged: {seq} of about {expected} frames could be read"

    def __init__(self, path: Path, config: CameraConfig) -> None:
        super().__init__(str(path), config, time.monotonic_ns, live=False)
        self._path = path

    def open(self) -> None:
        """Open from the start. Raises SourceRefused with the cause."""
        self.close()
        refuse_unreadable(self._path)
        refuse_non_video(self._path)
        try:
            self._decoder = Decoder(self.name, self._config, self._clock_ns)
        except OSError:
            raise SourceRefused(f"video file '{self.name}' cannot be decoded: {why_no_video(self._path)}") from None
        self.rate_hz = self._decoder.rate_hz
        self._seq = 0


class Stream(Video):
    """An RTSP or HTTP URL. A film of known length on a web server is a recording, played at its own rate; all else is live."""

    broken = "stream '{name}' broke off: {seq} of about {expected} frames came"

    def __init__(self, url: str, config: CameraConfig, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        super().__init__(without_credentials(url), config, clock_ns, live=True)
        self._url = url

    def open(self) -> None:
        """Connect. Raises SourceLost with the cause, SourceRefused for a URL that names no host."""
        self.close()
        parts = _split(self._url, self.name)
        try:
            with _ffmpeg_options(RTSP_OPTIONS if parts.scheme.startswith("rtsp") else ""):
                self._decoder = Decoder(self._url, self._config, self._clock_ns)
        except OSError:
            raise SourceLost(f"stream '{self.name}' {why_no_stream(parts)}") from None
        self.live = self._decoder.expected == 0
        # Over HTTP a live stream does not say its rate, and FFmpeg then makes up 25.
        self.rate_hz = 0.0 if self.live and parts.scheme.startswith("http") else self._decoder.rate_hz
        if not self.live:
            self._seq = 0


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


def _split(url: str, name: str) -> SplitResult:
    try:
        parts = urlsplit(url)
        known = bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:
        known = False
    if not known:
        raise SourceRefused(f"'{name}' is not a URL with a host (special characters in a password are written as %XX)")
    return parts
