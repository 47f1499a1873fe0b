"""The newest tracks whose frame is here, with that frame."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Iterable

from deixis_schemas.messages import Frame, FrameId, Tracks


class Joiner:
    """Keeps the last few frames and tracks. A pair is given once, and none older than one already given."""

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._frames: OrderedDict[FrameId, Frame] = OrderedDict()
        self._tracks: deque[Tracks] = deque(maxlen=kept)

    @property
    def waits(self) -> Tracks | None:
        """The newest tracks that have no frame yet."""
        return self._tracks[-1] if self._tracks else None

    def add(self, frames: Iterable[Frame], tracks: Iterable[Tracks]) -> None:
        """What came, oldest first."""
        for frame in frames:
            self._frames[frame.frame_id] = frame
            self._frames.move_to_end(frame.frame_id)
        while len(self._frames) > self._kept:
            self._frames.popitem(last=False)
        self._tracks.extend(tracks)

    def take(self) -> tuple[Frame, Tracks] | None:
        """The newest pair; what came before it is dropped. None: no tracks have their frame here."""
        for index in reversed(range(len(self._tracks))):
            tracks = self._tracks[index]
            if tracks.frame_id in self._frames:
                for _ in range(index + 1):
                    self._tracks.popleft()
                while (first := self._frames.popitem(last=False))[0] != tracks.frame_id:
                    pass
                return first[1], tracks
        return None
