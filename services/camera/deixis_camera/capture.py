"""The capture thread: reads the source, has its pictures prepared, and tries again when it is lost.

A read may block for seconds (a stream, an unplugged device); heartbeats go on because this thread does nothing else.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from .calibration import Calibration
from .config import CameraConfig
from .devices import Device
from .diagnosis import refuse_unreadable
from .folders import Pictures, is_picture
from .handoff import Became, Handoff, Noted, Opened, Ready, Refused
from .ladder import Rung
from .pacing import Backoff, RateLimit, period_ns
from .pictures import Preparation
from .sources import (
    Picture,
    PictureRefused,
    Source,
    SourceBroken,
    SourceLost,
    SourceRefused,
    device_path,
    is_stream,
    local_path,
)
from .videos import Stream, VideoFile

THREAD_NAME = "camera-capture"
GOOD_PICTURES = 10
"""A source that gave this many is back: its next loss starts the pauses anew."""
BAD_PICTURES = 30
"""A live source whose first or next pictures are all refused, this many in a row, has the wrong settings."""


def source_for(config: CameraConfig) -> Source:
    """The reader for `config.source`, not opened yet.

    A number or a device file is a camera, a URL a stream, a folder or a picture its pictures, all else a video file.
    Raises SourceRefused for a file that is missing, unreadable or empty, and for a URL of an unknown scheme.
    """
    device = device_path(config.source)
    if device is not None:
        return Device(device, config)
    if is_stream(config.source):
        return Stream(config.source, config)
    path = local_path(config.source)
    if path.is_dir():
        return Pictures(path, config.rate_hz)
    refuse_unreadable(path)
    return Pictures(path, config.rate_hz) if is_picture(path) else VideoFile(path, config)


class Capture(threading.Thread):
    """Reads `config.source` into `handoff`, and calls `wake` after each thing put there.

    How each picture is made is what `rung` says then. Runs are numbered from `first_run`: each pass through a recording is one;
    a live source that comes back goes on in its own.
    """

    def __init__(
        self,
        config: CameraConfig,
        calibration: Calibration,
        handoff: Handoff,
        first_run: int,
        *,
        rung: Callable[[], Rung],
        lockstep: bool,
        wake: Callable[[], None],
        log: logging.Logger,
    ) -> None:
        super().__init__(name=THREAD_NAME, daemon=True)
        self._config = config
        self._handoff = handoff
        self._rung = rung
        self._lockstep = lockstep
        self._wake = wake
        self._log = log
        self._stopped = threading.Event()
        self._preparation = Preparation(config, calibration, lambda key, text: self._report(Noted(key, text)))
        self._rate_limit = RateLimit(rung().rate_hz)
        self._backoff = Backoff(config.retry_first_s, config.retry_longest_s)
        self._run = first_run
        self._begun = False
        self._pass_began_ns = 0
        self._pass_ends_ns = 0

    def stop(self, longest_s: float) -> None:
        """Ask the thread to end and wait at most `longest_s`; a read that hangs in FFmpeg cannot be interrupted."""
        self._stopped.set()
        self._handoff.close()
        self.join(longest_s)

    def run(self) -> None:
        """Read until the end, a final failure, or `stop`."""
        try:
            self._read_source(source_for(self._config))
        except SourceRefused as error:
            self._report(Became("failed", str(error)))
        except Exception as error:
            self._log.exception("the capture thread ended")
            self._report(Became("failed", f"internal error while reading: {type(error).__name__}"))

    def _read_source(self, source: Source) -> None:
        try:
            while not self._stopped.is_set():
                try:
                    self._play(source)
                    return
                except SourceLost as error:
                    self._report(Became("retrying", str(error)))
                source.close()
                self._stopped.wait(self._backoff.next_s())
        finally:
            source.close()

    def _play(self, source: Source) -> None:
        """Open and read to the end, with `loop` again and again. Raises SourceRefused or SourceLost."""
        while not self._stopped.is_set():
            source.open()
            if source.live and self._lockstep:
                raise SourceRefused(f"'{source.name}' is live: lockstep needs a file or a folder of pictures")
            self._begin_pass(source)
            self._report(Opened(source.live, source.rate_hz))
            end = self._read_to_end(source)
            if not self._config.loop or self._stopped.is_set():
                self._report(end)
                return
            if end.broken:
                self._report(Refused(end.reason))

    def _begin_pass(self, source: Source) -> None:
        if self._begun and not source.live:
            self._run += 1
        self._begun = True
        self._pass_began_ns = self._pass_ends_ns

    def _read_to_end(self, source: Source) -> Became:
        """Read and hand over. Raises SourceRefused where no picture can be used, SourceLost for a live source."""
        used = refused = bad_in_a_row = 0
        first_reason = ""
        end = Became("ended")
        while not self._stopped.is_set():
            try:
                picture = source.read()
                if picture is None:
                    break
                self._hand_over(picture, source)
            except PictureRefused as error:
                refused, bad_in_a_row = refused + 1, bad_in_a_row + 1
                first_reason = first_reason or str(error)
                self._report(Refused(str(error)))
                if source.live and bad_in_a_row >= BAD_PICTURES:
                    raise SourceRefused(f"'{source.name}': {BAD_PICTURES} pictures in a row cannot be used: {error}") from None
                continue
            except SourceBroken as error:
                end = Became("ended", str(error), broken=True)
                break
            used, bad_in_a_row = used + 1, 0
            if used == GOOD_PICTURES:
                self._backoff.succeeded()
        if not used and not self._stopped.is_set():
            raise SourceRefused(_nothing_used(source.name, refused, first_reason, end))
        return end

    def _hand_over(self, picture: Picture, source: Source) -> None:
        """Prepare and pass on; a recording's time goes on from pass to pass. Raises PictureRefused."""
        time_ns = picture.time_ns
        if not source.live:
            time_ns += self._pass_began_ns
            self._pass_ends_ns = time_ns + period_ns(source.rate_hz)
        rung = self._rung()
        self._rate_limit.limit(rung.rate_hz)
        if not self._rate_limit.lets(time_ns):
            return
        encoded, intrinsics = self._preparation.prepare(picture.image, rung.quality)
        ready = Ready(self._run, picture.seq, time_ns, encoded, intrinsics, rung.quality)
        put = self._handoff.put_live if source.live else self._handoff.put_recorded
        put(ready)
        self._wake()

    def _report(self, item: Opened | Became | Refused | Noted) -> None:
        self._handoff.report(item)
        self._wake()


def _nothing_used(name: str, refused: int, first_reason: str, end: Became) -> str:
    if refused:
        return f"'{name}': none of its {refused} pictures can be used: {first_reason}"
    return end.reason if end.broken else f"'{name}' holds no picture that can be decoded"
