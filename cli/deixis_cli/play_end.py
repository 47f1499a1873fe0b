"""Tells when a played source is done: ended, and its last frame answered by all stages that answer frames."""

from __future__ import annotations

from collections.abc import Sequence

from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, FrameId, Message, OfFrame
from deixis_schemas.topics import By, Topic

# A stage works on the newest frame, so the last one is answered soon, unless the stage is ill or its answer was lost.
GRACE_S = 3.0


class PlayEnd:
    """Hears what is published; `now_s` is monotonic."""

    def __init__(self, stages: Sequence[str]) -> None:
        self.camera: CameraInfo | None = None
        self._awaited = [topic for topic in topics.TOPICS if topic.by is By.FRAME and topic.stage in stages]
        self._answered: dict[str, FrameId] = {}
        self._ended_s: float | None = None

    def hear(self, topic: Topic, message: Message | None, now_s: float) -> None:
        """A message was published."""
        if isinstance(message, CameraInfo):
            self._hear_camera(message, now_s)
        elif isinstance(message, OfFrame):
            self._answered[topic.path] = message.frame_id

    def failure(self) -> str | None:
        """Why the source will not deliver at all; none while it may."""
        return self.camera.reason or "the camera has failed" if self.camera and self.camera.state == "failed" else None

    def is_over(self, now_s: float) -> bool:
        """Whether nothing is to come any more, except the last targets."""
        if self._ended_s is None or self.camera is None:
            return False
        return now_s - self._ended_s > GRACE_S or not self.unanswered()

    def unanswered(self) -> list[str]:
        """Topics on which the last frame is not answered."""
        if self.camera is None or self.camera.last_seq < 0:  # there was none
            return []
        last = FrameId(self.camera.run, self.camera.last_seq)
        return [topic.path for topic in self._awaited if self._answered.get(topic.path) != last]

    def _hear_camera(self, info: CameraInfo, now_s: float) -> None:
        if info.state != "ended":
            self._ended_s = None
        elif self._ended_s is None:
            self._ended_s = now_s
        self.camera = info
