"""The evidence on one person: what a frame showed, and what hand and head showed over a stroke."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import Gesture, HeadPose, Side, SourceStatus

from .localisation import PersonPlace, wrapped_deg
from .pointing import PointingGesture

Values = npt.NDArray[np.float64]
StageStatus = tuple[SourceStatus, str]

POINTING: tuple[PointingGesture, ...] = ("point_left", "point_right", "invisible")


@dataclass(frozen=True)
class Sample:
    """One frame of one person: what gesture and headpose said of the person, none where they said nothing.

    `at_ns` is the time of `RunClock`, for durations; `stamp_ns` is the frame's stamp, to be published. `place` is where the
    person stood then, and the camera: with it an angle is a ray in the map.
    """

    at_ns: int
    stamp_ns: int
    gesture: Gesture | None
    pose: HeadPose | None
    place: PersonPlace | None = None

    @cached_property
    def pointing(self) -> PointingGesture | None:
        """The pointing gesture of a stroke; none in other phases and for other gestures."""
        if self.gesture is None or self.gesture.phase != "stroke":
            return None
        return next((kind for kind in POINTING if kind == self.gesture.gesture), None)

    @property
    def unclear(self) -> bool:
        """A stroke whose gesture could not be told."""
        return self.gesture is not None and self.gesture.phase == "stroke" and self.gesture.gesture == "none"

    @property
    def not_pointing(self) -> bool:
        """A stroke of an open hand, a wave and the like."""
        return self.gesture is not None and self.gesture.phase == "stroke" and self.gesture.gesture == "other"

    @cached_property
    def curve(self) -> Values | None:
        """The gesture stage's likelihood of bearings, where it tells it."""
        told = self.gesture.bearing_likelihood if self.gesture is not None else ()
        return np.array(told) if told else None

    def turn_to(self, axis_deg: float | None) -> float:
        """What is added to a bearing seen then, to have it from the direction `axis_deg` in the map; degrees."""
        if axis_deg is None or self.place is None:
            return 0.0
        return wrapped_deg(self.place.axis_deg - axis_deg)


Weighed = Sequence[tuple[Sample, float]]


@dataclass(frozen=True)
class HandObservation:
    """A pointing stroke: the gesture recognised and, where it could be told, the bearing pointed to and by which hand.

    `mirrored`: the bearing may as well be 180 - bearing, or `mirror` with its sigma, where both were seen from several sides.
    `agreement` is the share of the frames that said so. `likelihood` is that of bearings -180, -175 ... 175, where the stage
    tells it: it then counts instead of bearing and sigma.
    """

    gesture: PointingGesture
    bearing_deg: float | None = None
    bearing_sigma_deg: float | None = None
    mirrored: bool = False
    agreement: float = 1.0
    hand: Side | None = None
    likelihood: tuple[float, ...] = ()
    mirror: tuple[float, float] | None = None

    @property
    def mirror_deg(self) -> float | None:
        """The other bearing that it may be; none where there is only one."""
        if not self.mirrored or self.bearing_deg is None:
            return None
        return self.mirror[0] if self.mirror else wrapped_deg(180.0 - self.bearing_deg)

    @property
    def bearings(self) -> list[tuple[float, float]]:
        """The bearings that it may be, each with its sigma, degrees; none where none could be told."""
        if self.bearing_deg is None:
            return []
        sigma, other = self.bearing_sigma_deg or 0.0, self.mirror_deg
        told = [(self.bearing_deg, sigma)]
        return told if other is None else [*told, (other, self.mirror[1] if self.mirror else sigma)]


@dataclass(frozen=True)
class HeadObservation:
    """A tracked head: its yaw, or (`yaw_deg` none) that it is turned beyond the range, to `side` where that is known.

    `beyond_deg` is that range, where the stage tells it.
    """

    yaw_deg: float | None
    yaw_sigma_deg: float | None = None
    side: Side | None = None
    agreement: float = 1.0
    beyond_deg: float | None = None


class View(NamedTuple):
    """What hand and head showed while the person stood in one place, and which share of all that each showed it is.

    `place` is none where that is the place where the person stands now.
    """

    hand: HandObservation | None
    head: HeadObservation | None
    place: PersonPlace | None = None
    hand_share: float = 1.0
    head_share: float = 1.0


class Witness(NamedTuple):
    """How one stage stands, its process, and in words what it observed or why nothing. `stamp_ns` is the time it speaks of."""

    status: SourceStatus
    observed: str
    producer: str = ""
    stamp_ns: int | None = None


class Evidence(NamedTuple):
    """What hand and head of one person show, none where nothing can be told, and who says so.

    `views`: the same, from the places where it was seen; empty where that was one place.
    """

    hand: HandObservation | None
    gesture: Witness
    head: HeadObservation | None
    headpose: Witness
    views: tuple[View, ...] = ()
