"""Joins tracks with the frame they speak of."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Iterable

from deixis_schemas.messages import Frame, FrameId, Tracks


class FrameJoiner:
    """Keeps the last few frames and the last few tracks, and gives the newest pair of the same run and `seq`.

    A pair is given once, and never one that is older than one already given, except from a camera that started anew.
    """

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._frames: OrderedDict[FrameId, Frame] = OrderedDict()
        self._waiting: deque[Tracks] = deque(maxlen=kept)

    def add_frames(self, frames: Iterable[Frame]) -> None:
        """Keep frames, in the order they came; the oldest go."""
        for frame in frames:
            self._frames[frame.frame_id] = frame
            self._frames.move_to_end(frame.frame_id)
            while len(self._frames) > self._kept:
                self._frames.popitem(last=False)

    def add_tracks(self, tracks: Iterable[Tracks]) -> None:
        """Keep tracks, in the order they came; either of frame and tracks may come first."""
        self._waiting.extend(tracks)

    def take(self) -> tuple[Frame, Tracks] | None:
        """The newest tracks whose frame is held, with that frame; what came before them is dropped. None: no pair yet."""
        for index in reversed(range(len(self._waiting))):
            tracks = self._waiting[index]
            frame = self._frames.get(tracks.frame_id)
            if frame is not None:
                self._drop_up_to(index, tracks.frame_id)
                return frame, tracks
        return None

    def _drop_up_to(self, index: int, frame_id: FrameId) -> None:
        for _ in range(index + 1):
            self._waiting.popleft()
        while next(iter(self._frames)) != frame_id:
            self._frames.popitem(last=False)
        del self._frames[frame_id]
