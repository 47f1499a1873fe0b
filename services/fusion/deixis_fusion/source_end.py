"""Tells when the frames have come to their end, so that open episodes get their final answer."""

from __future__ import annotations

from deixis_schemas.messages import CameraInfo, FrameId

# The last frames of a source may be lost on the way (newest wins): then its end is believed after this.
GRACE_S = 1.0


class SourceEnd:
    """Watches the camera's word and the flow of answered frames; `now_s` is monotonic."""

    def __init__(self, silent_s: float) -> None:
        self._silent_s = silent_s
        self._ended: CameraInfo | None = None
        self._ended_s = 0.0
        self._answered_s: float | None = None
        self._answered: FrameId | None = None

    def hear(self, info: CameraInfo, now_s: float) -> None:
        """The camera says how it is; it repeats that every few seconds."""
        if info.state != "ended":
            self._ended = None
        elif self._ended is None:
            self._ended, self._ended_s = info, now_s

    def answered(self, frame_id: FrameId, now_s: float) -> None:
        """A frame was answered."""
        self._answered_s, self._answered = now_s, frame_id

    def is_over(self, now_s: float, waits: bool) -> bool:
        """Whether no frame is to come any more; true once, until the next frame is answered.

        `waits`: a live camera may hold its next frame back, as in lockstep, so that silence alone means nothing.
        """
        if self._answered_s is None:
            return False
        last_seen = self._ended is not None and self._answered == FrameId(self._ended.run, self._ended.last_seq)
        ended = self._ended is not None and (last_seen or now_s - self._ended_s > GRACE_S)
        silent = not waits and now_s - self._answered_s > self._silent_s
        if not (ended or silent):
            return False
        self._answered_s, self._answered = None, None
        return True
