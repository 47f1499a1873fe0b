"""Clips scored one after the other, until all are or somebody stops it: what was scored until then is kept."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from deixis_runtime.interrupts import Interrupts

from .clip_progress import OnFrame, played
from .clips import Clip
from .interrupted import Interrupted


class Score(Protocol):
    """What is made of a clip."""

    @property
    def failure(self) -> str | None:
        """Why the clip was not played; none where it was."""


S = TypeVar("S", bound=Score)


@dataclass(frozen=True)
class Scored(Generic[S]):
    """The scores in the order of the clips; `clips` were chosen. `stopped` is what ended it before the last of them."""

    scores: list[S]
    clips: int
    stopped: Interrupted | None = None

    @property
    def left(self) -> int:
        """Clips that were not come to."""
        return self.clips - len(self.scores)

    def status(self) -> int:
        """Say what is missing; the exit status: 0 for nothing, 1 for a clip, 128 and the signal where it was stopped."""
        failed = sum(score.failure is not None for score in self.scores)
        if failed:
            print(f"deixis eval: {failed} of {len(self.scores)} clips were not played", file=sys.stderr)
        if self.stopped is not None:
            figures = "; the figures are those of these" if self.scores else ""
            said = f"{self.stopped} before the end, after {len(self.scores)} of {self.clips} clips{figures}"
            print(f"deixis eval: {said}", file=sys.stderr)
            return 128 + self.stopped.signal
        return 1 if failed else 0


def score_each(clips: Sequence[Clip], score: Callable[[Clip, OnFrame], S]) -> Scored[S]:
    """Score the clips, with a bar on standard error. SIGINT and SIGTERM end it at the next frame, and the clip is left out."""
    scores: list[S] = []
    with Interrupts() as interrupts:

        def going_on(on_frame: OnFrame) -> OnFrame:
            def tell() -> None:
                if interrupts.signal is not None:
                    raise Interrupted(interrupts.signal)
                on_frame()

            return tell

        try:
            for clip, on_frame, complain in played(clips):
                found = score(clip, going_on(on_frame))
                if found.failure is not None:
                    complain(f"{clip.name}: {found.failure}")
                scores.append(found)
        except Interrupted as stopped:
            return Scored(scores, len(clips), stopped)
    return Scored(scores, len(clips))
