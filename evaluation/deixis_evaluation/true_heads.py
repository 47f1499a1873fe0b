"""The true yaw in place of headpose: what it would say of the persons that are tracked, were it never wrong."""

from __future__ import annotations

from collections.abc import Sequence

from deixis_headpose.ellipsoid_head import yaw_sigma_deg
from deixis_schemas import topics
from deixis_schemas.messages import HeadPose, HeadPoses, Message, Side, Tracks

from .clips import TruePerson, Truth
from .speaker import producer_of
from .tracked_persons import TrackedPersons

RANGE_DEG = 130.0
"""Beyond this the truth says `out_of_range`, as headpose does and fusion expects."""


class TrueHeads:
    """Answers each Tracks with the true HeadPoses."""

    topic = topics.HEAD_POSES

    def __init__(self, truth: Truth) -> None:
        self._truth = truth
        self._persons = TrackedPersons(truth)

    def begin(self) -> Sequence[Message]:
        """Nothing: there is no frame yet."""
        return ()

    def hear(self, message: Message) -> Sequence[Message]:
        """The heads of the persons tracked."""
        if not isinstance(message, Tracks):
            return ()
        poses = [self._pose(own, person) for own, person in self._persons.match(message).items()]
        return (HeadPoses.derive(message, producer_of(self.topic), poses=poses),)

    def _pose(self, own: int, person: TruePerson) -> HeadPose:
        yaw = person.head.yaw_rel_deg
        if not self._truth.in_picture(person.head.center_px):
            return HeadPose(person_id=own, status="lost")
        if abs(yaw) > RANGE_DEG:
            side: Side = "left" if yaw > 0 else "right"
            return HeadPose(person_id=own, status="out_of_range", side=side, beyond_deg=RANGE_DEG)
        # The sigma that the method `ellipsoid` states for a perfect match: fusion weighs the truth as it weighs a stage.
        sigma = yaw_sigma_deg(yaw, correlation=1.0, held_s=0.0)
        return HeadPose(person_id=own, status="tracking", yaw_deg=yaw, yaw_sigma_deg=sigma)
