"""What every stage sees at the moment, gathered from what is published."""

from __future__ import annotations

from deixis_schemas import topics
from deixis_schemas.messages import (
    Belief,
    CameraInfo,
    Frame,
    Gestures,
    HeadPoses,
    Health,
    Message,
    OfFrame,
    Poi,
    Target,
    Tracks,
)

from . import wording


class Summary:
    """The newest words on each stage. `names` are POI names by id; it learns those that are put."""

    def __init__(self, names: dict[str, str]) -> None:
        self.names = names
        self.camera = "waiting for the camera"
        self.words: dict[str, str] = {}
        self.target: Target | None = None
        self.clip_s = 0.0
        self.seq = -1
        self._run = -1
        self._first_ns: int | None = None
        self._frames = 0
        self._timed = 0
        self._since: tuple[int, int] | None = None
        self._rate_hz = 0.0
        self._answers = 0
        self._health: dict[str, Health] = {}

    def hear(self, message: Message) -> None:
        """Take in one message."""
        if isinstance(message, Frame):
            self._hear_frame(message)
        elif isinstance(message, Tracks):
            self.words[topics.TRACKS.stage] = wording.tracked(message)
        elif isinstance(message, HeadPoses):
            self.words[topics.HEAD_POSES.stage] = wording.heads(message)
        elif isinstance(message, Gestures):
            self.words[topics.GESTURES.stage] = wording.gestures(message)
        elif isinstance(message, Belief):
            self._answers += 1
            if not self._frames:
                self._keep_time(message)  # who looks on from afar hears no frames
            self.words[topics.BELIEF.stage] = wording.belief(message, self.names)
        elif isinstance(message, Target):
            self.target = message
        elif isinstance(message, Poi):
            self.names[message.poi_id] = message.name
        elif isinstance(message, CameraInfo):
            self.camera = message.state + (f": {message.reason}" if message.reason else "")
        elif isinstance(message, Health):
            self._health[message.stage] = message

    def rate_hz(self) -> float:
        """Frames per second of clip time, over about the last second."""
        return self._rate_hz

    def drops(self) -> int:
        """Frames that got no answer so far, less the one on its way."""
        return max(0, self._frames - self._answers - 1) if self._answers and self._frames else 0

    def faults(self) -> list[str]:
        """Stages that say that they are not well."""
        return [f"{stage} {item.state}: {item.reason}" for stage, item in sorted(self._health.items()) if item.state != "ok"]

    def line(self) -> str:
        """Everything in one line."""
        frame = f"{self.clip_s:6.1f} s  frame {self.seq}  {self._rate_hz:.0f}/s"
        frame += f"  {self.drops()} dropped" if self._frames else ""
        return " | ".join([frame, *(self.words[stage] for stage in topics.STAGES if stage in self.words)])

    def _hear_frame(self, frame: Frame) -> None:
        self._frames += 1
        self._keep_time(frame)

    def _keep_time(self, message: OfFrame) -> None:
        if self._first_ns is None or message.run != self._run:
            self._run, self._first_ns, self._since = message.run, message.stamp_ns, None
        self.seq = message.seq
        self.clip_s = (message.stamp_ns - self._first_ns) / 1e9
        self._timed += 1
        since_ns, before = self._since or (message.stamp_ns, self._timed)
        if message.stamp_ns - since_ns >= 1_000_000_000:
            self._rate_hz = (self._timed - before) * 1e9 / (message.stamp_ns - since_ns)
            since_ns, before = message.stamp_ns, self._timed
        self._since = since_ns, before
