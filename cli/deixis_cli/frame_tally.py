"""How many frames a camera gave, by the numbers in all that was said of them: pictures are large, and some are missed."""

from __future__ import annotations

from deixis_schemas.messages import FrameId

RUNS_KEPT = 8


class FrameTally:
    """Counts frames from the first to the last that was spoken of, of each run."""

    def __init__(self) -> None:
        self._runs: dict[int, tuple[int, int]] = {}
        self._before = 0  # of runs that nobody speaks of any more

    def note(self, frame: FrameId) -> None:
        """Somebody spoke of this frame."""
        first, last = self._runs.get(frame.run, (frame.seq, frame.seq))
        self._runs[frame.run] = min(first, frame.seq), max(last, frame.seq)
        if len(self._runs) > RUNS_KEPT:
            first, last = self._runs.pop(next(iter(self._runs)))
            self._before += last - first + 1

    @property
    def frames(self) -> int:
        """That there were so far."""
        return self._before + sum(last - first + 1 for first, last in self._runs.values())
