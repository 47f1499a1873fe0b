"""From the capture thread to the loop thread: pictures ready to publish, and what happened between them, in order."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

from deixis_schemas.messages import CameraState

from .calibration import Intrinsics
from .pictures import Encoded


@dataclass(frozen=True)
class Ready:
    """A picture ready to publish. `run` and `seq` name it; `time_ns` as in sources.Picture, and over all passes.

    `quality` is that of the JPEG; none of a raw picture.
    """

    run: int
    seq: int
    time_ns: int
    encoded: Encoded
    intrinsics: Intrinsics
    quality: int | None = None


@dataclass(frozen=True)
class Opened:
    """The source is open; pictures follow."""

    live: bool
    rate_hz: float


@dataclass(frozen=True)
class Became:
    """The source changed its state; `reason` is a sentence, `broken` a recording that ended before its end."""

    state: CameraState
    reason: str = ""
    broken: bool = False


@dataclass(frozen=True)
class Refused:
    """One picture could not be used."""

    reason: str


@dataclass(frozen=True)
class Noted:
    """A condition worth showing, under a key that a later one replaces."""

    key: str
    text: str


Item = Ready | Opened | Became | Refused | Noted


class Handoff:
    """A queue with two manners: a recording's pictures wait for room, of a live source the newest replaces the one before."""

    def __init__(self, depth: int = 4) -> None:
        self._depth = depth
        self._items: deque[Item] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._overwritten = 0

    def put_recorded(self, picture: Ready) -> None:
        """Wait for room and append; returns at once when the reader has gone."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self.waiting_pictures() < self._depth)
            if not self._closed:
                self._items.append(picture)

    def put_live(self, picture: Ready) -> None:
        """Append, in place of a picture that was not fetched in time."""
        with self._changed:
            kept = [item for item in self._items if not isinstance(item, Ready)]
            self._overwritten += len(self._items) - len(kept)
            self._items = deque([*kept, picture])

    def report(self, item: Opened | Became | Refused | Noted) -> None:
        """Append what happened."""
        with self._changed:
            self._items.append(item)

    def first(self) -> Item | None:
        """The oldest item, left in place; None when there is none."""
        with self._changed:
            return self._items[0] if self._items else None

    def take(self, item: Item) -> bool:
        """Remove `item`, which `first` gave; False where a newer live picture has come in its place meanwhile."""
        with self._changed:
            there = bool(self._items) and self._items[0] is item
            if there:
                self._items.popleft()
                self._changed.notify_all()
            return there

    def waiting_pictures(self) -> int:
        """Pictures in the queue."""
        with self._changed:
            return sum(isinstance(item, Ready) for item in self._items)

    def take_overwritten(self) -> int:
        """Live pictures replaced since the last call."""
        with self._changed:
            count, self._overwritten = self._overwritten, 0
            return count

    def close(self) -> None:
        """No more is fetched; a waiting writer returns."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
