"""How fusion sees the stages that it listens to: alive, late, of a wrong version, or two of them on one key."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from deixis_schemas.messages import SourceState, SourceStatus

MAX_PRODUCERS = 8


@dataclass(frozen=True)
class Reading:
    """What the session knows of one stage's key at one time.

    `age_s`: since the last accepted message; `last_error_kind` is empty when the last message was accepted.
    """

    stage: str
    alive: bool
    received: int = 0
    rejected: int = 0
    age_s: float | None = None
    last_error: str = ""
    last_error_kind: str = ""
    producers: tuple[str, ...] = ()


class SourceMonitor:
    """Judges stages from successive readings; `now_s` is monotonic."""

    def __init__(self, stages: Iterable[str], dead_after_s: float) -> None:
        self._dead_after_s = dead_after_s
        self._readings = {stage: Reading(stage, alive=False) for stage in stages}
        self._rejected_s: dict[str, float] = {}
        self._now_s = 0.0

    def update(self, readings: Iterable[Reading], now_s: float) -> None:
        """Take in new readings."""
        self._now_s = now_s
        for reading in readings:
            if reading.rejected > self._readings[reading.stage].rejected:
                self._rejected_s[reading.stage] = now_s
            self._readings[reading.stage] = reading

    def status(self, stage: str, answered: bool | None = None) -> tuple[SourceStatus, str]:
        """Status of a stage and why it is not ok. `answered`: whether it answered the frame in question, none for no frame."""
        reading = self._readings[stage]
        if answered:
            return "ok", ""
        if self._refused_lately(reading):
            kind: SourceStatus = "wrong_version" if reading.last_error_kind == "wrong_version" else "late"
            return kind, f"its messages are refused: {reading.last_error}"
        silent = reading.age_s is None or reading.age_s > self._dead_after_s
        if silent and not reading.alive:
            return "dead", "no such process is alive" if reading.age_s is None else f"gone, silent for {reading.age_s:.1f} s"
        if answered is False:
            return "late", "did not answer this frame in time"
        if silent and reading.age_s is None:
            return "late", "alive, but has sent nothing yet"
        return "ok", f"silent for {reading.age_s:.0f} s" if silent else ""

    def dead(self) -> set[str]:
        """The stages that are not worth waiting for."""
        return {stage for stage in self._readings if self.status(stage)[0] in ("dead", "wrong_version")}

    def states(self) -> list[SourceState]:
        """All stages for State."""
        return [self._state(reading) for reading in self._readings.values()]

    def doubled(self) -> list[str]:
        """One sentence for each key on which several processes publish."""
        return [
            f"{len(reading.producers)} producers on the key of {reading.stage}: {', '.join(sorted(reading.producers))}"
            for reading in self._readings.values()
            if len(reading.producers) > 1
        ]

    def producers(self, stage: str) -> tuple[str, ...]:
        """The processes heard lately on the stage's key, as `stage/instance`."""
        return self._readings[stage].producers

    def _state(self, reading: Reading) -> SourceState:
        status, reason = self.status(reading.stage)
        double = next((text for text in self.doubled() if f" of {reading.stage}:" in text), "")
        return SourceState(
            stage=reading.stage,
            status=status,
            producers=sorted(reading.producers)[:MAX_PRODUCERS],
            age_s=reading.age_s,
            received=reading.received,
            rejected=reading.rejected,
            reason="; ".join(part for part in (reason, double) if part),
        )

    def _refused_lately(self, reading: Reading) -> bool:
        """Whether what it sent last was refused, and that not long ago; an accepted message clears `last_error_kind`."""
        at_s = self._rejected_s.get(reading.stage)
        return at_s is not None and bool(reading.last_error_kind) and self._now_s - at_s <= self._dead_after_s
