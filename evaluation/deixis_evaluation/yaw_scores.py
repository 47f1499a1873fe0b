"""Scores of head yaw, by how far the head is truly turned."""

from __future__ import annotations

from dataclasses import dataclass

from deixis_schemas.messages import HeadPose

from .clips import TruePerson, Truth
from .recording import Recording

BANDS = {"0-15": 15.0, "15-30": 30.0, "30-60": 60.0, "60-90": 90.0, "over_90": 180.0}
"""Name and upper limit of |true yaw|, degrees."""
LARGE_ERROR_DEG = 20.0


@dataclass(frozen=True)
class YawBand:
    """Counts of the frames of one band; errors are those of status `tracking`.

    said_or_side: out of range was said, or the yaw tracked has the right sign. silent: tracked, and wrong by more than
    LARGE_ERROR_DEG.
    """

    frames: int = 0
    tracking: int = 0
    out_of_range: int = 0
    said_or_side: int = 0
    silent: int = 0
    sum_abs_error_deg: float = 0.0

    def __add__(self, other: YawBand) -> YawBand:
        return YawBand(
            self.frames + other.frames,
            self.tracking + other.tracking,
            self.out_of_range + other.out_of_range,
            self.said_or_side + other.said_or_side,
            self.silent + other.silent,
            self.sum_abs_error_deg + other.sum_abs_error_deg,
        )

    @property
    def mae_deg(self) -> float | None:
        """Mean absolute error while tracking."""
        return self.sum_abs_error_deg / self.tracking if self.tracking else None

    @property
    def large_error_share(self) -> float | None:
        """Share of tracked frames that are wrong by more than LARGE_ERROR_DEG."""
        return self.silent / self.tracking if self.tracking else None

    def share(self, count: int) -> float | None:
        """A count by frames."""
        return count / self.frames if self.frames else None


def band_of(yaw_deg: float) -> str:
    """Name of the band that a true yaw falls into."""
    return next(name for name, limit in BANDS.items() if abs(yaw_deg) < limit or name == "over_90")


def score_yaw(truth: Truth, recording: Recording, persons: dict[int, int]) -> dict[str, YawBand]:
    """Score the head poses of a clip by band. `persons`: the true person behind each tracked one.

    Heads outside the picture are left out.
    """
    bands = dict.fromkeys(BANDS, YawBand())
    for frame in truth.frames:
        for person in frame.persons:
            if truth.in_picture(person.head.center_px):
                pose = pose_of(person, recording.poses_at(frame.frame), persons)
                name = band_of(person.head.yaw_rel_deg)
                bands[name] += _score_pose(person.head.yaw_rel_deg, pose)
    return bands


def pose_of(person: TruePerson, poses: list[HeadPose], persons: dict[int, int]) -> HeadPose | None:
    """The pose that speaks of this person; one with a yaw first where the tracker has split the person in two."""
    own = [pose for pose in poses if persons.get(pose.person_id) == person.id]
    return min(own, key=lambda pose: (pose.status != "tracking", pose.person_id), default=None)


def angle_error_deg(angle_deg: float, true_deg: float) -> float:
    """Absolute difference of two angles, 0 to 180."""
    return abs((angle_deg - true_deg + 180) % 360 - 180)


def _score_pose(true_deg: float, pose: HeadPose | None) -> YawBand:
    if pose is None:
        return YawBand(frames=1)
    if pose.status == "out_of_range":
        wrong_side = pose.side is not None and (pose.side == "left") != (true_deg > 0)
        return YawBand(frames=1, out_of_range=1, said_or_side=int(not wrong_side))
    if pose.status != "tracking" or pose.yaw_deg is None:
        return YawBand(frames=1)
    error = angle_error_deg(pose.yaw_deg, true_deg)
    return YawBand(
        frames=1,
        tracking=1,
        said_or_side=int((pose.yaw_deg > 0) == (true_deg > 0)),
        silent=int(error > LARGE_ERROR_DEG),
        sum_abs_error_deg=error,
    )
