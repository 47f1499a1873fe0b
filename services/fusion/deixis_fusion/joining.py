"""Joins tracks, poses and gestures of one frame, so that every frame gets one answer, in order."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from deixis_schemas import topics
from deixis_schemas.messages import FrameId, Gestures, HeadPoses, OfFrame, Tracks

Part = Tracks | HeadPoses | Gestures

TRACKER, HEADPOSE, GESTURE = topics.TRACKS.stage, topics.HEAD_POSES.stage, topics.GESTURES.stage
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
    """Collects the parts of frames and hands out each frame once, in the order of `seq`.

    A frame is due when every stage has answered it or, which is as good as a no, a later one; or when `age_limit_s` has
    passed since its tracks arrived. Tracks of another run begin that run: what is left of the last one is due at once.
    """

    def __init__(self, age_limit_s: float) -> None:
        self._age_limit_s = age_limit_s
        self._pending: dict[FrameId, _Pending] = {}
        self._left: list[JoinedFrame] = []
        self._newest: dict[str, int] = {}
        self._run: int | None = None
        self._last_run: int | None = None
        self._answered = -1
        self.dropped = 0

    def add(self, part: Part, now_s: float) -> None:
        """Take in a message that arrived at `now_s` (monotonic).

        Parts of frames that have been answered are `dropped`, and so are the oldest frames where too many wait.
        """
        if self._run is None or (isinstance(part, Tracks) and part.run != self._run):
            self._begin(part.run)
        if part.run == self._last_run or (part.run == self._run and part.seq <= self._answered):
            self.dropped += 1
            return
        pending = self._pending.setdefault(part.frame_id, _Pending(now_s))
        if isinstance(part, Tracks):
            pending.arrived_s = now_s
        if pending.frame.part_of(stage_of(part)) is None:
            _fill(pending.frame, part)
        if part.run == self._run:
            self._newest[stage_of(part)] = max(self._newest.get(stage_of(part), -1), part.seq)
        self._forget_oldest()

    def due(self, now_s: float, absent: Collection[str] = ()) -> list[JoinedFrame]:
        """The frames to be answered now, oldest first. Stages in `absent` are known to be dead and not waited for."""
        ready, self._left = self._left, []
        for frame_id in self._of_run(self._run):
            if not self._is_due(frame_id, self._pending[frame_id], now_s, absent):
                break
            ready.append(self._pending.pop(frame_id).frame)
            self._answered = frame_id.seq
        for frame in ready:
            frame.missing = tuple(stage for stage in STAGES if frame.part_of(stage) is None)
        return ready

    def next_due_s(self) -> float | None:
        """When the oldest frame reaches the age limit (monotonic seconds); none where nothing waits."""
        arrivals = [self._pending[frame_id].arrived_s for frame_id in self._of_run(self._run)]
        return min(arrivals) + self._age_limit_s if arrivals else None

    def _of_run(self, run: int | None) -> list[FrameId]:
        return sorted(frame_id for frame_id in self._pending if frame_id.run == run)

    def _is_due(self, frame_id: FrameId, pending: _Pending, now_s: float, absent: Collection[str]) -> bool:
        if now_s - pending.arrived_s >= self._age_limit_s:
            return True
        return all(
            pending.frame.part_of(stage) is not None or stage in absent or self._newest.get(stage, -1) > frame_id.seq
            for stage in STAGES
        )

    def _begin(self, run: int) -> None:
        self._left += [self._pending.pop(frame_id).frame for frame_id in self._of_run(self._run)]
        self._run, self._last_run, self._answered = run, self._run, -1
        # Poses and gestures may have come before the first tracks of their run: keys do not wait for each other.
        self._newest = {}
        for frame_id in self._of_run(run):
            for stage in STAGES:
                if self._pending[frame_id].frame.part_of(stage) is not None:
                    self._newest[stage] = frame_id.seq

    def _forget_oldest(self) -> None:
        while len(self._pending) > MAX_PENDING:
            del self._pending[min(self._pending, key=lambda frame_id: self._pending[frame_id].arrived_s)]
            self.dropped += 1


def _fill(frame: JoinedFrame, part: Part) -> None:
    if isinstance(part, Tracks):
        frame.tracks = part
    elif isinstance(part, HeadPoses):
        frame.poses = part
    else:
        frame.gestures = part
