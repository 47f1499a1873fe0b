"""What a method of head pose is given for one person and frame, and what it answers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from deixis_runtime.lens import Pinhole
from deixis_schemas.messages import HeadPose, Point, PoseStatus, Side, Track
from numpy.typing import NDArray

LEAST_FACE_PX = 8.0
"""Narrower faces show nothing to read."""
ANYWHERE_DEG = 360 / math.sqrt(12)
"""Standard deviation of an angle of which nothing is known: a head whose pose is no surer is lost."""


class Sight(NamedTuple):
    """What one frame shows of one person."""

    picture: NDArray[np.uint8]
    camera: Pinhole
    face: Track
    hands: Sequence[Track]
    now_ns: int


@dataclass(frozen=True)
class HeadState:
    """The answer for one head in one frame. angles_deg: yaw, pitch, roll.

    sigma_deg: of the yaw. variances_deg2: of all three, where the method tells them. face_width_px: from the front, likewise.
    beyond_deg: where out of range, the yaw beyond which the method reads no head.
    """

    status: PoseStatus
    angles_deg: tuple[float, float, float] | None = None
    sigma_deg: float | None = None
    side: Side | None = None
    variances_deg2: tuple[float, float, float] | None = None
    face_width_px: float | None = None
    beyond_deg: float | None = None

    def of_person(self, person_id: int) -> HeadPose:
        """As a message."""
        if self.status != "tracking" or self.angles_deg is None:
            return HeadPose(person_id=person_id, status=self.status, side=self.side, beyond_deg=self.beyond_deg)
        yaw, pitch, roll = self.angles_deg
        covariance = None
        if self.variances_deg2 is not None:
            # The errors of the three hardly go together: they are taken as independent.
            of_yaw, of_pitch, of_roll = self.variances_deg2
            covariance = (of_yaw, 0.0, 0.0, of_pitch, 0.0, of_roll)
        return HeadPose(
            person_id=person_id,
            status=self.status,
            yaw_deg=yaw,
            yaw_sigma_deg=self.sigma_deg,
            pitch_deg=pitch,
            roll_deg=roll,
            covariance_deg2=covariance,
            face_width_px=self.face_width_px,
        )


def side_of(yaw_deg: float) -> Side:
    """The person's own side that a head is turned to."""
    return "left" if yaw_deg > 0 else "right"


def centre_of(face: Track) -> Point:
    """Centre of a face's box, which is the head's (pixel coordinates)."""
    x, y, width, height = face.bbox_px
    return x + (width - 1) / 2, y + (height - 1) / 2
