"""Joins tracks with the frame that they speak of, and tells what becomes of tracks that get no answer."""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from collections.abc import Iterable

from deixis_schemas.messages import Frame, FrameId, Tracks

REMEMBERED = 64
"""So many frames back it is known which came: more than come by within the age limit of a message."""


class FrameJoiner:
    """Keeps the last few frames and the last few tracks, and gives the newest pair of the same run and `seq`.

    A pair is given once, and never one that is older than one already given, except from a camera that started anew.
    unjoined: the last tracks given up without an answer since there was a pair; none while there are pairs.
    """

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._frames: OrderedDict[FrameId, Frame] = OrderedDict()
        self._came: deque[FrameId] = deque(maxlen=max(REMEMBERED, kept))
        self._waiting: deque[Tracks] = deque()
        self._dropped: Counter[str] = Counter()
        self.unjoined: Tracks | None = None

    @property
    def newest_frame(self) -> FrameId | None:
        """The last frame that came; none before the first."""
        return self._came[-1] if self._came else None

    def add_frames(self, frames: Iterable[Frame]) -> None:
        """Keep frames, in the order they came; the oldest go."""
        for frame in frames:
            self._came.append(frame.frame_id)
            self._frames[frame.frame_id] = frame
            self._frames.move_to_end(frame.frame_id)
            while len(self._frames) > self._kept:
                self._frames.popitem(last=False)

    def add_tracks(self, tracks: Iterable[Tracks]) -> None:
        """Keep tracks, in the order they came; either of frame and tracks may come first."""
        for message in tracks:
            self._waiting.append(message)
            while len(self._waiting) > self._kept:
                self.unjoined = self._drop_tracks()

    def take(self) -> tuple[Frame, Tracks] | None:
        """The newest tracks whose frame is held, with that frame; what came before them is dropped. None: no pair yet."""
        for index in reversed(range(len(self._waiting))):
            tracks = self._waiting[index]
            frame = self._frames.get(tracks.frame_id)
            if frame is not None:
                self._drop_up_to(index, tracks.frame_id)
                return frame, tracks
        return None

    def take_dropped(self) -> Counter[str]:
        """How many tracks got no answer since the last call: their frame never came, or they were too late for theirs."""
        dropped, self._dropped = self._dropped, Counter()
        return dropped

    def came(self, frame_id: FrameId) -> bool:
        """Whether that frame is one of those that came, or that were lost on the way between them."""
        seqs = [came.seq for came in self._came if came.run == frame_id.run]
        return bool(seqs) and min(seqs) <= frame_id.seq <= max(seqs)

    def _drop_up_to(self, index: int, frame_id: FrameId) -> None:
        for _ in range(index):
            self._drop_tracks()
        self._waiting.popleft()
        self.unjoined = None
        while next(iter(self._frames)) != frame_id:
            self._frames.popitem(last=False)
        del self._frames[frame_id]

    def _drop_tracks(self) -> Tracks:
        tracks = self._waiting.popleft()
        self._dropped["tracks_skipped" if self.came(tracks.frame_id) else "tracks_without_frame"] += 1
        return tracks
