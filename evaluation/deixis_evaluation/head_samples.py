"""Truth and answer side by side: each true head in each frame, with what headpose says of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from deixis_schemas.messages import HeadPose, Side

from .angle_scores import AngleScore, signed_error_deg
from .clips import Truth
from .recording import Recording
from .true_angles import TrueAngles, true_angles
from .yaw_scores import pose_of

AngleName = Literal["yaw", "pitch", "roll"]
ANGLES: tuple[AngleName, ...] = ("yaw", "pitch", "roll")
VARIANCE_AT: dict[AngleName, int] = {"yaw": 0, "pitch": 3, "roll": 5}
"""Where the variances stand in `covariance_deg2`."""
ABSENT = "absent"
"""In place of a status: no pose speaks of the person, for the tracker does not follow it."""


@dataclass(frozen=True)
class HeadSample:
    """A true head in one frame, and the pose that speaks of it."""

    frame: int
    person: int
    true: TrueAngles
    pose: HeadPose | None = None

    @property
    def status(self) -> str:
        """The pose's status, or ABSENT."""
        return self.pose.status if self.pose is not None else ABSENT

    @property
    def tracked(self) -> HeadPose | None:
        """The pose where its angles are stated."""
        return self.pose if self.pose is not None and self.pose.status == "tracking" else None

    @property
    def side(self) -> Side | None:
        """The person's own side to which the head is said to be turned, by its yaw or in words; none where none is said."""
        if self.pose is None:
            return None
        if self.tracked is not None and self.tracked.yaw_deg is not None:
            return _side(self.tracked.yaw_deg)
        return self.pose.side

    @property
    def side_is_right(self) -> bool:
        """Whether the side said is the true one."""
        return self.side == _side(self.true.yaw)

    def error_deg(self, angle: AngleName) -> float | None:
        """Signed error of a tracked angle; none where it is not stated, or the truth is not known."""
        stated: float | None = getattr(self.tracked, f"{angle}_deg", None)
        true: float | None = getattr(self.true, angle)
        return None if stated is None or true is None else signed_error_deg(stated, true)

    def sigma_deg(self, angle: AngleName) -> float | None:
        """Stated standard deviation of a tracked angle."""
        if self.tracked is None:
            return None
        if angle == "yaw" and self.tracked.yaw_sigma_deg is not None:
            return self.tracked.yaw_sigma_deg
        covariance = self.tracked.covariance_deg2
        return None if covariance is None else float(covariance[VARIANCE_AT[angle]] ** 0.5)


def head_samples(truth: Truth, recording: Recording, persons: dict[int, int]) -> list[HeadSample]:
    """All true heads of a clip that are in the picture. `persons`: the true person behind each tracked one."""
    return [
        HeadSample(frame.frame, person.id, true_angles(person.head), pose_of(person, recording.poses_at(frame.frame), persons))
        for frame in truth.frames
        for person in frame.persons
        if truth.in_picture(person.head.center_px)
    ]


def angle_score(samples: list[HeadSample], angle: AngleName) -> AngleScore:
    """Errors and sigmas of one angle over the samples that state it."""
    stated = [(error, item.sigma_deg(angle)) for item in samples if (error := item.error_deg(angle)) is not None]
    return AngleScore([error for error, _ in stated], [sigma for _, sigma in stated])


def _side(yaw_deg: float) -> Side:
    return "left" if yaw_deg > 0 else "right"
