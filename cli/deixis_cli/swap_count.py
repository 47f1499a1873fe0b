"""What a swap cost, by what was heard: frames without an answer, and frames answered twice. No clock, no I/O."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from statistics import median

from deixis_schemas.messages import FrameId


@dataclass(frozen=True)
class Cost:
    """Of one swap, and of the answers around it.

    gap_frames: frames between the last that the old one answered and the newcomer's first that should have been answered and
    were not. gap_s: from the one answer to the other; usual_s: from one to the next. twice: answers to a frame that had one
    already. unanswered, answered: frames, over all that was heard.
    """

    gap_frames: int
    gap_s: float
    usual_s: float
    twice: int
    unanswered: int
    answered: int


@dataclass
class SwapCount:
    """Frames that were given and the answers of two processes, in the order in which they came."""

    old: str
    new: str
    _given: dict[FrameId, None] = field(default_factory=dict)
    _answers: list[tuple[FrameId, str, float]] = field(default_factory=list)

    def give(self, frame: FrameId) -> None:
        """A frame came that the stage is to answer."""
        self._given[frame] = None

    def hear(self, frame: FrameId, instance: str, at_s: float) -> None:
        """An answer that came at this monotonic time."""
        self._answers.append((frame, instance, at_s))

    def answers_of_new(self) -> int:
        """How many frames the newcomer has answered."""
        return sum(instance == self.new for _, instance, _ in self._answers)

    def cost(self) -> Cost | None:
        """None where not both were heard."""
        of_old = [(frame, at_s) for frame, instance, at_s in self._answers if instance == self.old]
        of_new = [(frame, at_s) for frame, instance, at_s in self._answers if instance == self.new]
        if not of_old or not of_new:
            return None
        frames = [frame for frame, _, _ in self._answers]
        times = [at_s for _, _, at_s in self._answers]
        (last, last_s), (first, first_s) = of_old[-1], of_new[0]
        given = list(self._given)
        # What was given when we began to listen, or is being worked on, is nobody's fault.
        judged = given[_place(given, frames[0], 0) : _place(given, frames[-1], len(given))]
        between = given[_place(given, last, 0) : _place(given, first, 0)]
        return Cost(
            gap_frames=len(set(between) - set(frames)),
            gap_s=max(0.0, first_s - last_s),
            usual_s=median(later - earlier for earlier, later in pairwise(times)),
            twice=len(frames) - len(set(frames)),
            unanswered=len(set(judged) - set(frames)),
            answered=len(set(frames)),
        )


def _place(given: list[FrameId], frame: FrameId, otherwise: int) -> int:
    return given.index(frame) if frame in given else otherwise
