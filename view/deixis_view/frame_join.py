"""Brings together what the stages say of one frame, and chooses the frames that are drawn."""

from __future__ import annotations

from collections import OrderedDict

from deixis_schemas.messages import Belief, Frame, FrameId, Gestures, HeadPoses, OfFrame, Tracks

from .frame_view import FrameView

# As many as a belief may be behind at 30 Hz, and no more bytes than this of their pictures.
MAX_FRAMES = 16
MAX_PICTURE_BYTES = 48 << 20
# Where nobody answers frames, they are drawn without an answer once they are so old.
UNANSWERED_NS = 500_000_000


class FrameJoin:
    """Hears messages of frames; gives those that are to be drawn, at most `rate_hz` a second by their stamps."""

    def __init__(self, rate_hz: float) -> None:
        # A little less: of 30 frames a second every third is 10 a second, though stamps tremble.
        self._period_ns = round(0.9e9 / rate_hz)
        self._held: OrderedDict[FrameId, FrameView] = OrderedDict()
        self._drawn: FrameView | None = None
        self._drawn_at_ns: int | None = None

    def hear(self, message: OfFrame, now_ns: int) -> FrameView | None:
        """Take in a message that came at `now_ns`; a frame that is to be drawn now, or none."""
        if self._drawn_at_ns is None:
            self._drawn_at_ns = now_ns
        view = self._held.setdefault(message.frame_id, FrameView(message.frame_id, message.stamp_ns))
        if isinstance(message, Frame):
            view.frame = message
        elif isinstance(message, Tracks):
            view.tracks = message
        elif isinstance(message, HeadPoses):
            view.poses = message
        elif isinstance(message, Gestures):
            view.gestures = message
        elif isinstance(message, Belief):
            view.belief = message
            return self._answered(view, now_ns)
        self._bound()
        return self._unanswered(now_ns)

    def _answered(self, view: FrameView, now_ns: int) -> FrameView | None:
        for frame_id in [held for held, other in self._held.items() if self._is_past(other, view)]:
            del self._held[frame_id]
        return self._draw(view, now_ns)

    def _unanswered(self, now_ns: int) -> FrameView | None:
        """The newest frame that a stage has looked at, or else the newest, where no answer has come for long."""
        if now_ns - (self._drawn_at_ns or 0) < UNANSWERED_NS or not self._held:
            return None
        seen = [view for view in self._held.values() if view.tracks is not None] or list(self._held.values())
        return self._draw(seen[-1], now_ns)

    def _draw(self, view: FrameView, now_ns: int) -> FrameView | None:
        before = self._drawn
        if before is not None and before.frame_id.run == view.frame_id.run:
            anew = before.frame_id == view.frame_id and view.belief is not None  # its answer was late
            if view.stamp_ns - before.stamp_ns < self._period_ns and not anew:
                return None
        self._drawn = FrameView(view.frame_id, view.stamp_ns)
        self._drawn_at_ns = now_ns
        return view

    def _bound(self) -> None:
        while len(self._held) > 1 and (len(self._held) > MAX_FRAMES or self._picture_bytes() > MAX_PICTURE_BYTES):
            self._held.popitem(last=False)

    def _picture_bytes(self) -> int:
        return sum(len(view.frame.data) for view in self._held.values() if view.frame is not None)

    @staticmethod
    def _is_past(other: FrameView, view: FrameView) -> bool:
        return other.frame_id.run != view.frame_id.run or other.stamp_ns <= view.stamp_ns
