"""OpenCV's video reader with time limits and media time."""

from __future__ import annotations

import math

import cv2

from .sources import Image

LONGEST_STEP_NS = 60_000_000_000
"""A jump of media time beyond this is a damaged time stamp, not a pause in the film."""


class Decoder:
    """One opened video; recordings and streams share it.

    Raises OSError when OpenCV cannot open `location`.
    """

    def __init__(self, location: str, *, open_timeout_s: float, read_timeout_s: float, threads: int) -> None:
        settings = [
            cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(open_timeout_s * 1000),
            cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(read_timeout_s * 1000),
            cv2.CAP_PROP_N_THREADS, threads,
        ]  # fmt: skip
        self._capture = cv2.VideoCapture(location, cv2.CAP_FFMPEG, settings)
        if not self._capture.isOpened():
            self._capture.release()
            raise OSError("OpenCV with FFmpeg cannot open it")
        self._last_ns = -1
        self._first_ns: int | None = None

    @property
    def rate_hz(self) -> float:
        """Frames per second by the container; 0 where it does not say anything sensible."""
        rate = self._capture.get(cv2.CAP_PROP_FPS)
        return float(rate) if math.isfinite(rate) and 0 < rate <= 240 else 0.0

    @property
    def expected_frames(self) -> int:
        """Frames by the container; 0 where it does not say, as with a live stream."""
        count = self._capture.get(cv2.CAP_PROP_FRAME_COUNT)
        return int(count) if math.isfinite(count) and 0 < count < 2**53 else 0

    def read(self) -> Image | None:
        """The next picture, None when there is none."""
        good, image = self._capture.read()
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
            time_ns = self._last_ns + self._frame_ns() if self._last_ns >= 0 else 0
        self._last_ns = time_ns
        return time_ns

    def close(self) -> None:
        """Let go of the file or connection."""
        self._capture.release()

    def _frame_ns(self) -> int:
        return round(1e9 / (self.rate_hz or 25.0))
