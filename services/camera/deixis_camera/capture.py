"""The capture thread: reads the source, prepares its pictures, and tries again when it is lost.

A read may block for seconds (a stream, an unplugged device); heartbeats go on because this thread does nothing else.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from .calibration import Calibration, CalibrationError, Intrinsics
from .config import CameraConfig
from .encode import encode
from .handoff import Became, Handoff, Noted, Opened, Ready, Refused
from .kinds import source_for
from .pacing import Backoff, RateLimit
from .pictures import Normaliser
from .sources import Picture, PictureRefused, Source, SourceBroken, SourceLost, SourceRefused

THREAD_NAME = "camera-capture"
GOOD_PICTURES = 10
"""A source that gave this many is back: its next loss starts the pauses anew."""
BAD_PICTURES = 30
"""A live source whose first or next pictures are all refused, this many in a row, has the wrong settings."""


class Preparation:
    """From a source's picture to one ready to publish: rate limit, normal form, intrinsics, encoding."""

    def __init__(self, config: CameraConfig, calibration: Calibration, note: Callable[[str, str], None]) -> None:
        self._config = config
        self._calibration = calibration
        self._note = note
        self._rate_limit = RateLimit(config.rate_hz)
        self._normaliser = Normaliser(config.max_width)
        self._intrinsics: dict[tuple[int, int], Intrinsics] = {}
        self._notes: dict[str, str] = {}

    def prepare(self, picture: Picture, passes: int, time_ns: int) -> Ready | None:
        """The picture ready to publish at `time_ns`; None where the rate limit leaves it out. Raises PictureRefused."""
        if not self._rate_limit.lets(time_ns):
            return None
        normal = self._normaliser.normalise(picture.image)
        intrinsics = self._intrinsics_for(normal.size_px)
        if normal.scaled:
            self._note_change("scaled", f"pictures of {_by(normal.arrived_px)} are scaled down to {_by(normal.size_px)}")
        if self._normaliser.deep:
            self._note_change("depth", f"16-bit pictures are taken as {self._normaliser.bits}-bit and published as 8-bit")
        return Ready(
            passes, picture.seq, time_ns, encode(normal.image, self._config.encoding, self._config.quality), intrinsics
        )

    def _intrinsics_for(self, size: tuple[int, int]) -> Intrinsics:
        if size not in self._intrinsics:
            try:
                found = self._calibration.for_size(*size)
            except CalibrationError as error:
                raise PictureRefused(str(error)) from None
            self._intrinsics = {size: found}  # one size is the rule; of a folder of many only the last is kept
        return self._intrinsics[size]

    def _note_change(self, key: str, text: str) -> None:
        if self._notes.get(key) != text:
            self._notes[key] = text
            self._note(key, text)


class Capture(threading.Thread):
    """Reads `config.source` into `handoff`, and calls `wake` after each thing put there."""

    def __init__(
        self,
        config: CameraConfig,
        calibration: Calibration,
        handoff: Handoff,
        *,
        lockstep: bool,
        now_ns: Callable[[], int],
        wake: Callable[[], None],
        log: logging.Logger,
    ) -> None:
        super().__init__(name=THREAD_NAME, daemon=True)
        self._config = config
        self._handoff = handoff
        self._lockstep = lockstep
        self._now_ns = now_ns
        self._wake = wake
        self._log = log
        self._stopped = threading.Event()
        self._preparation = Preparation(config, calibration, lambda key, text: self._report(Noted(key, text)))
        self._backoff = Backoff(config.retry_first_s, config.retry_longest_s)
        self._shift_ns = 0
        self._passes = -1

    def stop(self, longest_s: float) -> None:
        """Ask the thread to end and wait at most `longest_s`; a read that hangs in FFmpeg cannot be interrupted."""
        self._stopped.set()
        self._handoff.close()
        self.join(longest_s)

    def run(self) -> None:
        """Read until the end, a final failure, or `stop`."""
        try:
            self._read_source(source_for(self._config, self._now_ns))
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
            if self._passes < 0 or not source.live:  # a live source that comes back goes on counting
                self._passes += 1
            self._report(Opened(source.live, source.rate_hz))
            end = self._read_to_end(source)
            if not self._config.loop or self._stopped.is_set():
                self._report(end)
                return
            if end.broken:
                self._report(Refused(end.reason))

    def _read_to_end(self, source: Source) -> Became:
        """Read and hand over. Raises SourceRefused where no picture can be used, SourceLost for a live source."""
        used = refused = bad_in_a_row = 0
        first_reason = ""
        end = Became("ended")
        last_ns, period_ns = 0, round(1e9 / source.rate_hz) if source.rate_hz > 0 else 40_000_000
        while not self._stopped.is_set():
            try:
                picture = source.read()
                if picture is None:
                    break
                period_ns, last_ns = max(1, picture.time_ns - last_ns) if picture.seq else period_ns, picture.time_ns
                self._hand_over(picture, source.live)
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
        self._shift_ns += last_ns + period_ns
        return end

    def _hand_over(self, picture: Picture, live: bool) -> None:
        ready = self._preparation.prepare(picture, self._passes, picture.time_ns if live else picture.time_ns + self._shift_ns)
        if ready is None:
            return
        put = self._handoff.put_live if live else self._handoff.put_recorded
        put(ready)
        self._wake()

    def _report(self, item: Opened | Became | Refused | Noted) -> None:
        self._handoff.report(item)
        self._wake()


def _nothing_used(name: str, refused: int, first_reason: str, end: Became) -> str:
    if refused:
        return f"'{name}': none of its {refused} pictures can be used: {first_reason}"
    return end.reason if end.broken else f"'{name}' holds no picture that can be decoded"


def _by(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]}"
