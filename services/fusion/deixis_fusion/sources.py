"""How fusion sees those that it listens to: alive, late, of a wrong version, or two of them on one key; and when they end."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from deixis_schemas.messages import MAX_TEXT, CameraInfo, FrameId, SourceState, SourceStatus

MAX_PRODUCERS = 8
# The last frames of a source may be lost on the way (newest wins): then its end is believed after this.
GRACE_S = 1.0


@dataclass(frozen=True)
class Reading:
    """What the session knows of one stage's key at one time.

    `age_s`: since the last accepted message; `last_error_kind` is empty when the last message was accepted.
    """

    stage: str
    alive: bool
    key: str = ""
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

    def status(self, stage: str, *, missed: bool = False) -> tuple[SourceStatus, str]:
        """Status of a stage and why it is not ok. `missed`: it did not answer the frame in question."""
        reading = self._readings[stage]
        silent = reading.age_s is None or reading.age_s > self._dead_after_s
        # While others on the key are understood, what is refused must not stand in their way: an old stage that somebody
        # forgot would switch off the one that replaced it.
        if silent and self._refused_lately(reading):
            kind: SourceStatus = "wrong_version" if reading.last_error_kind == "wrong_version" else "late"
            return kind, f"its messages on {reading.key} are refused: {reading.last_error}"
        if silent and not reading.alive:
            return "dead", "no such process is alive" if reading.age_s is None else f"gone, silent for {reading.age_s:.1f} s"
        if missed:
            return "late", "did not answer this frame in time"
        if silent and reading.age_s is None:
            return "late", "alive, but has sent nothing yet"
        # Alive and silent is no fault: no frame came, or what it says changes seldom. How long, says `age_s`.
        return "ok", ""

    def dead(self) -> set[str]:
        """The stages that are not worth waiting for."""
        return {stage for stage in self._readings if self.status(stage)[0] in ("dead", "wrong_version")}

    def states(self) -> list[SourceState]:
        """All stages for State."""
        return [self._state(reading) for reading in self._readings.values()]

    def refused(self) -> list[str]:
        """One sentence for each key on which messages were refused lately beside others that were accepted."""
        return [text for reading in self._readings.values() if (text := self._refused_beside(reading))]

    def doubled(self) -> list[str]:
        """One sentence for each key on which several processes publish."""
        return [text for reading in self._readings.values() if (text := _doubled(reading))]

    def _state(self, reading: Reading) -> SourceState:
        status, reason = self.status(reading.stage)
        return SourceState(
            stage=reading.stage,
            status=status,
            producers=sorted(reading.producers)[:MAX_PRODUCERS],
            age_s=reading.age_s,
            received=reading.received,
            rejected=reading.rejected,
            reason="; ".join(part for part in (reason, self._refused_beside(reading), _doubled(reading)) if part)[:MAX_TEXT],
        )

    def _refused_beside(self, reading: Reading) -> str:
        """What was refused on the key of a stage that is understood; empty where nothing was."""
        if not self._refused_lately(reading) or self.status(reading.stage)[0] != "ok":
            return ""
        return f"{reading.key}: some messages are refused: {reading.last_error}"

    def _refused_lately(self, reading: Reading) -> bool:
        """Whether a message on its key was refused not long ago."""
        at_s = self._rejected_s.get(reading.stage)
        return at_s is not None and self._now_s - at_s <= self._dead_after_s


def _doubled(reading: Reading) -> str:
    """Who publishes on the key of a stage, where there are several; else empty."""
    if len(reading.producers) < 2:
        return ""
    return f"{reading.key}: {len(reading.producers)} producers: {', '.join(sorted(reading.producers))}"


class SourceEnd:
    """Watches the camera's word and the flow of answered frames; `now_s` is monotonic."""

    def __init__(self, silent_s: float) -> None:
        self._silent_s = silent_s
        self._ended: CameraInfo | None = None
        self._ended_s = 0.0
        self._answered_s: float | None = None
        self._answered: FrameId | None = None

    def hear(self, info: CameraInfo, now_s: float) -> None:
        """The camera says how it is; it repeats that every few seconds."""
        if info.state != "ended":
            self._ended = None
        elif self._ended is None:
            self._ended, self._ended_s = info, now_s

    def answered(self, frame_id: FrameId, now_s: float) -> None:
        """A frame was answered."""
        self._answered_s, self._answered = now_s, frame_id

    def is_over(self, now_s: float, waits: bool) -> bool:
        """Whether no frame is to come any more; true once, until the next frame is answered.

        `waits`: a live camera may hold its next frame back, as in lockstep, so that silence alone means nothing.
        """
        if self._answered_s is None:
            return False
        last_seen = self._ended is not None and self._answered == FrameId(self._ended.run, self._ended.last_seq)
        ended = self._ended is not None and (last_seen or now_s - self._ended_s > GRACE_S)
        silent = not waits and now_s - self._answered_s > self._silent_s
        if not (ended or silent):
            return False
        self._answered_s, self._answered = None, None
        return True
