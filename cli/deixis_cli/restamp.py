"""Makes of recorded messages what they would be if they were said now."""

from __future__ import annotations

from typing import TypeVar

from deixis_schemas.messages import CameraInfo, Message, OfFrame, Produced, Target

M = TypeVar("M", bound=Message)


class Restamper:
    """Moves stamps by a fixed time, and gives each run of the recording one of its own: stages that run take a known
    run for a camera that goes on, and what they know of its persons for true.
    """

    def __init__(self, shift_ns: int, first_run: int, instance: str) -> None:
        """`instance` names the process that says it again: two recordings of one stage are two producers."""
        self._shift_ns = shift_ns
        self._first_run = first_run
        self._instance = instance
        self._runs: dict[int, int] = {}

    def now(self, message: M) -> M:
        """The message with stamp, run and instance as of now."""
        if not isinstance(message, Produced):
            return message
        changes: dict[str, object] = {"stamp_ns": self._moved(message.stamp_ns), "instance": self._instance}
        if isinstance(message, OfFrame):
            changes["run"] = self._run(message.run)
        if isinstance(message, Target):
            changes["started_ns"] = self._moved(message.started_ns)
            changes["ended_ns"] = self._moved(message.ended_ns)
        if isinstance(message, CameraInfo):
            changes["lockstep"] = False
            changes["run"] = self._run(message.run) if message.last_seq >= 0 else message.run
        return message.model_copy(update=changes)

    def _moved(self, stamp_ns: int) -> int:
        return max(0, stamp_ns + self._shift_ns)

    def _run(self, run: int) -> int:
        return self._runs.setdefault(run, self._first_run + len(self._runs))
