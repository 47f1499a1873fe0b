"""Cameras of this machine (V4L2)."""

from __future__ import annotations

import time
from collections.abc import Callable

import cv2

from .config import CameraConfig
from .diagnosis import why_no_pictures, why_not_openable
from .sources import Picture, SourceLost

WARM_UP_READS = 3
OLDEST_BUFFER_MS = 2000.0


class Device:
    """A V4L2 camera, read at its own rate. `clock_ns` is the monotonic clock, by which V4L2 stamps its buffers."""

    live = True

    def __init__(self, path: str, config: CameraConfig, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._path = path
        self._config = config
        self._clock_ns = clock_ns
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
        self._ask_for_settings(capture)
        if not any(capture.grab() for _ in range(WARM_UP_READS)):  # nor does one that could not be opened
            capture.release()
            raise SourceLost(f"camera '{self._path}' {why_no_pictures(self._path)}")
        self._capture = capture
        rate = capture.get(cv2.CAP_PROP_FPS)
        self.rate_hz = float(rate) if 0 < rate <= 240 else 0.0

    def read(self) -> Picture:
        """Wait for the next picture. Raises SourceLost when the device has gone or stopped."""
        capture = self._capture
        if capture is None or not capture.grab():
            raise self._lost()
        time_ns = captured_ns(capture.get(cv2.CAP_PROP_POS_MSEC), self._clock_ns())
        good, image = capture.retrieve()  # decodes: a large MJPG takes longer than a period
        if not good:
            raise self._lost()
        picture = Picture(seq=self._seq, time_ns=time_ns, image=image)
        self._seq += 1
        return picture

    def close(self) -> None:
        """Give the device back."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None

    def _lost(self) -> SourceLost:
        cause = why_not_openable(self._path) or "stopped giving pictures (unplugged, or taken by another program)"
        return SourceLost(f"camera '{self._path}' {cause}")

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


def captured_ns(buffer_ms: float, grabbed_ns: int) -> int:
    """Time of capture on the monotonic clock, of a picture whose buffer is stamped `buffer_ms` and was fetched at `grabbed_ns`.

    Buffers wait in a queue of four, so the driver's stamp is the better one. Some drivers write 0 or the time of another
    clock there: one that is not of the last two seconds is not believed.
    """
    age_ms = grabbed_ns / 1e6 - buffer_ms
    return grabbed_ns - round(age_ms * 1e6) if 0 <= age_ms <= OLDEST_BUFFER_MS else grabbed_ns
