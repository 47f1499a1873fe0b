"""What the stages of a run take, from what they say in health: processor time by frame, and memory."""

from __future__ import annotations

from dataclasses import dataclass, field

from deixis_schemas.messages import Belief, Health, Message
from process_use import ProcessEnded, use_of

WARM_FRAMES = 15
"""Frames before the first heartbeat that counts: what a stage takes to load its models is no cost of a frame."""


@dataclass
class StageCost:
    """Of one stage over all runs: processor seconds and the frames in which it used them; the most memory it held (PSS)."""

    cpu_s: float = 0.0
    frames: int = 0
    pss_mb: float = 0.0

    @property
    def cpu_ms(self) -> float | None:
        """Processor time of a frame."""
        return 1e3 * self.cpu_s / self.frames if self.frames else None


@dataclass
class Meter:
    """Listens to one run after another; `begin` each of them."""

    stages: dict[str, StageCost] = field(default_factory=dict)
    _frames: int = 0
    _before: dict[str, tuple[int, float, int]] = field(default_factory=dict)

    def begin(self) -> None:
        """Another run, of other processes."""
        self._frames, self._before = 0, {}

    def hear(self, message: Message) -> None:
        """The next message of a run."""
        if isinstance(message, Belief):
            self._frames += 1
        if not isinstance(message, Health) or self._frames < WARM_FRAMES:
            return
        cost = self.stages.setdefault(message.stage, StageCost())
        pid, cpu_s, frames = self._before.get(message.stage, (0, 0.0, 0))
        if pid == message.pid:
            cost.cpu_s += message.cpu_s - cpu_s
            cost.frames += self._frames - frames
        self._before[message.stage] = message.pid, message.cpu_s, self._frames
        try:
            cost.pss_mb = max(cost.pss_mb, use_of(message.pid).pss_mb)
        except ProcessEnded:  # between what it said last and our look
            return
