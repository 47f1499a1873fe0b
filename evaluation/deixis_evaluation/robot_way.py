"""A robot that says where it is, as the labels of a clip with a moving camera tell."""

from __future__ import annotations

from collections.abc import Sequence

from deixis_schemas import topics
from deixis_schemas.messages import Frame, Message, RobotPose

from .camera_pose import FootPose
from .replay import START_NS
from .speaker import producer_of

AHEAD = 24
"""So many frames ahead the poses are said: fusion must know a frame's pose when it answers the frame, however busy the machine
is. Fusion keeps 5 s of poses, and takes in 32 at once."""


class RobotWay:
    """Says the pose of each frame, ahead of it: fusion takes the pose at the frame's stamp out of those around it.

    path: where the robot is in each frame. In lockstep the stamps are known beforehand (media time), and the first poses are
    said before the first frame; else the first frame's stamp tells the others, and fusion begins at the site's pose.
    """

    topic = topics.ROBOT_POSE

    def __init__(self, path: Sequence[FootPose], fps: float, *, lockstep: bool) -> None:
        self._path = path
        self._period_ns = 1e9 / fps
        self._lockstep = lockstep
        self._said = 0

    def begin(self) -> Sequence[Message]:
        """The first poses, in lockstep."""
        return self.ahead_of(0, START_NS) if self._lockstep else ()

    def hear(self, message: Message) -> Sequence[Message]:
        """The poses up to AHEAD frames after a frame."""
        return self.ahead_of(message.seq, message.stamp_ns) if isinstance(message, Frame) else ()

    def ahead_of(self, seq: int, stamp_ns: int) -> list[RobotPose]:
        """Poses from a frame on that were not said yet."""
        upto = min(len(self._path), seq + AHEAD)
        wanted = range(max(self._said, seq), upto)
        self._said = max(self._said, upto)
        return [self._pose(number, stamp_ns + round((number - seq) * self._period_ns)) for number in wanted]

    def _pose(self, number: int, stamp_ns: int) -> RobotPose:
        stage, instance = producer_of(self.topic)
        pose = self._path[number]
        return RobotPose(stamp_ns=stamp_ns, stage=stage, instance=instance, x_m=pose.x_m, y_m=pose.y_m, yaw_deg=pose.yaw_deg)
