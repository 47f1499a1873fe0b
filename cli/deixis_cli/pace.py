"""When each message of a recording is said again."""

from __future__ import annotations

from deixis_schemas.messages import CameraInfo, OfFrame

from .frame_groups import Line


class Pace:
    """Messages come as long after the first as they did when they were recorded.

    In a recording of lockstep they came when the machine got to them, while the stamps tell the time of the pictures: there
    the stamps set the pace. By the other, a recording of a slow machine would be played slower than its stamps run, and all in
    it would be too old after a while.
    """

    def __init__(self) -> None:
        self.by_stamps = False
        self._first_ns: int | None = None
        self._last_s = 0.0

    def after_s(self, line: Line) -> float:
        """Seconds after the first line; never less than of the line before."""
        message = line.message
        if isinstance(message, CameraInfo) and message.lockstep and not self.by_stamps:
            self.by_stamps, self._first_ns = True, None
        at_ns = (message.stamp_ns if isinstance(message, OfFrame) else None) if self.by_stamps else line.received_ns
        if at_ns is None:
            return self._last_s
        if self._first_ns is None:
            self._first_ns = at_ns - round(self._last_s * 1e9)
        self._last_s = max(self._last_s, (at_ns - self._first_ns) / 1e9)
        return self._last_s
