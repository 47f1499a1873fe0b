"""Joins tracks, poses and gestures of one frame, so that every frame gets one answer, in order."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from deixis_schemas.messages import Gestures, HeadPoses, OfFrame, Tracks

FrameId = tuple[int, int]
Part = Tracks | HeadPoses | Gestures

TRACKER, HEADPOSE, GESTURE = "tracker", "headpose", "gesture"
STAGES = (TRACKER, HEADPOSE, GESTURE)
MAX_PENDING = 256


def stage_of(part: Part) -> str:
    """The stage whose place in the frame this message fills, whoever made it."""
    if isinstance(part, Tracks):
        return TRACKER
    return HEADPOSE if isinstance(part, HeadPoses) else GESTURE


@dataclass
class JoinedFrame:
    """What is known about one frame; `missing` names the stages that did not answer for it."""

    tracks: Tracks | None = None
    poses: HeadPoses | None = None
    gestures: Gestures | None = None
    missing: tuple[str, ...] = ()

    @property
    def source(self) -> OfFrame:
        """A message about the frame, to derive the answer from."""
        part = self.tracks or self.poses or self.gestures
        assert part is not None
        return part

    def part_of(self, stage: str) -> Part | None:
        """The message of that stage."""
        return {TRACKER: self.tracks, HEADPOSE: self.poses, GESTURE: self.gestures}[stage]


@dataclass
class _Pending:
    arrived_s: float
    frame: JoinedFrame = field(default_factory=JoinedFrame)


class FrameJoiner:
    """Collects the parts of frames and hands out each frame once.

    A frame is due when every stage has answered it or, which is as good as a no, a later one; or when `age_limit_s` has
    passed since its tracks arrived. Frames are ordered by their stamps.
    """

    def __init__(self, age_limit_s: float, jump_back_s: float) -> None:
        self._age_limit_s = age_limit_s
        self._jump_back_ns = int(jump_back_s * 1e9)
        self._pending: dict[FrameId, _Pending] = {}
        self._newest_ns: dict[str, int] = {}
        self._answered_ns = -1
        self.late = 0

    def add(self, part: Part, now_s: float) -> bool:
        """Take in a message that arrived at `now_s` (monotonic). Returns whether it begins a new run of the camera.

        Parts of frames that have been answered are dropped and counted as `late`.
        """
        new_run = isinstance(part, Tracks) and part.stamp_ns < self._answered_ns - self._jump_back_ns
        if new_run:
            self._restart(part.stamp_ns)
        if part.stamp_ns <= self._answered_ns:
            self.late += 1
            return False
        stage = stage_of(part)
        self._newest_ns[stage] = max(self._newest_ns.get(stage, -1), part.stamp_ns)
        pending = self._pending.setdefault(part.frame_id, _Pending(now_s))
        if isinstance(part, Tracks):
            pending.arrived_s = now_s
        if pending.frame.part_of(stage) is None:
            _fill(pending.frame, part)
        self._forget_oldest()
        return new_run

    def due(self, now_s: float, absent: Collection[str] = ()) -> list[JoinedFrame]:
        """The frames to be answered now, oldest first. Stages in `absent` are known to be dead and not waited for."""
        ready = []
        for frame_id in sorted(self._pending, key=lambda key: (key[1], key[0])):
            pending = self._pending[frame_id]
            if not self._is_due(frame_id, pending, now_s, absent):
                break
            frame = pending.frame
            frame.missing = tuple(stage for stage in STAGES if frame.part_of(stage) is None)
            ready.append(frame)
            self._answered_ns = frame_id[1]
            del self._pending[frame_id]
        return ready

    def next_due_s(self) -> float | None:
        """When the oldest frame reaches the age limit (monotonic seconds); none where nothing waits."""
        if not self._pending:
            return None
        return min(pending.arrived_s for pending in self._pending.values()) + self._age_limit_s

    def _is_due(self, frame_id: FrameId, pending: _Pending, now_s: float, absent: Collection[str]) -> bool:
        if now_s - pending.arrived_s >= self._age_limit_s:
            return True
        return all(
            pending.frame.part_of(stage) is not None or stage in absent or self._newest_ns.get(stage, -1) > frame_id[1]
            for stage in STAGES
        )

    def _restart(self, stamp_ns: int) -> None:
        """Stamps start anew: what was kept of the last run is older than anything to come, and would block it."""
        self._pending = {key: pending for key, pending in self._pending.items() if key[1] <= stamp_ns + self._jump_back_ns}
        self._newest_ns = {}
        self._answered_ns = -1

    def _forget_oldest(self) -> None:
        while len(self._pending) > MAX_PENDING:
            del self._pending[min(self._pending, key=lambda key: key[1])]
            self.late += 1


def _fill(frame: JoinedFrame, part: Part) -> None:
    if isinstance(part, Tracks):
        frame.tracks = part
    elif isinstance(part, HeadPoses):
        frame.poses = part
    else:
        frame.gestures = part
