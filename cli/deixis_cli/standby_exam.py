"""Whether a process that stands by may be heard: what it says aside, beside the answers of who is heard. No clock, no I/O."""

from __future__ import annotations

from deixis_schemas import codec
from deixis_schemas.messages import FrameId, OfFrame
from deixis_schemas.topics import Topic

ENOUGH_FRAMES = 20
ANSWERED_SHARE = 0.5
"""Of as many frames as the other answers: on a machine that is busy each leaves out others."""
BEHIND_FRAMES = 30


class StandbyExam:
    """Compares the two. The one that is heard says which frames there were, and when each was captured."""

    def __init__(self, topic: Topic, instance: str) -> None:
        """Of the newcomer with that instance, which is to answer on `topic`."""
        self._topic = topic
        self._instance = instance
        self._of_old: dict[FrameId, int] = {}
        self._of_new: dict[FrameId, int] = {}
        self._old_since = 0
        self._complaint = ""

    def hear_old(self, message: OfFrame) -> None:
        """An answer of the process that is heard."""
        self._of_old[message.frame_id] = message.stamp_ns
        self._old_since += bool(self._of_new)

    def hear_new(self, payload: bytes, encoding: str) -> None:
        """What the newcomer says aside, as it was sent."""
        try:
            message = codec.decode(self._topic.type, payload, encoding, max_bytes=self._topic.max_bytes)
        except codec.CodecError as error:
            self._complain(f"its messages break the contract: {error}")
            return
        assert isinstance(message, OfFrame)
        if message.instance != self._instance:
            self._complain(f"it names itself '{message.instance}', and its token says '{self._instance}'")
        if message.frame_id in self._of_new:
            self._complain(f"it answers a frame twice: seq {message.seq} of run {message.run}")
        self._of_new[message.frame_id] = message.stamp_ns

    def enough(self) -> bool:
        """Whether a verdict can be given: a complaint, or frames enough."""
        return bool(self._complaint) or self._old_since >= ENOUGH_FRAMES

    def verdict(self) -> str:
        """Why the newcomer may not be heard; empty where it may."""
        if self._complaint:
            return self._complaint
        if not self._of_old:
            return "no frames come, so it cannot be seen at work: start the camera first"
        if not self._of_new:
            return f"it says nothing aside, while {len(self._of_old)} frames were answered"
        if len(self._of_new) < ANSWERED_SHARE * self._old_since:
            return f"it answers {len(self._of_new)} frames while {self._old_since} are answered"
        wrong = [frame for frame, stamp_ns in self._of_new.items() if self._of_old.get(frame, stamp_ns) != stamp_ns]
        if wrong:
            return f"it does not repeat the frame's stamp_ns: seq {wrong[0].seq} of run {wrong[0].run}"
        return self._behind()

    def _behind(self) -> str:
        newest, of_new = next(reversed(self._of_old)), next(reversed(self._of_new))
        if newest.run == of_new.run and newest.seq - of_new.seq > BEHIND_FRAMES:
            return f"it is {newest.seq - of_new.seq} frames behind"
        if newest.run != of_new.run and newest.seq > BEHIND_FRAMES:
            return f"it speaks of run {of_new.run}, while frames of run {newest.run} come"
        return ""

    def _complain(self, text: str) -> None:
        self._complaint = self._complaint or text
