"""The evidence on one person: what a frame showed, and what hand and head showed over a stroke."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from deixis_schemas.messages import Gesture, HeadPose, Side, SourceStatus

from .localisation import PersonPlace, wrapped_deg
from .pointing import PointingGesture

NAN = math.nan
POINTING: tuple[PointingGesture, ...] = ("point_left", "point_right", "invisible")


# What a frame shows in numbers, in this order in `Sample.row`; not a number where it does not tell. Kinds are places in
# `POINTING`, sides in `SIDES`, statuses in `STATUSES`.
_OF_HAND = (
    "kind", "hand", "bearing_deg", "bearing_sigma_deg", "mirrored", "has_curve", "elevation_deg", "elevation_sigma_deg",
)  # fmt: skip
_OF_HEAD = ("status", "yaw_deg", "yaw_sigma_deg", "side", "beyond_deg", "pitch_deg", "pitch_sigma_deg")
_OF_PLACE = ("axis_deg", "x_m", "y_m")
ROW = {name: i for i, name in enumerate(("at_ns", *_OF_HAND, *_OF_HEAD, *_OF_PLACE))}
SIDES: tuple[Side, ...] = ("left", "right")
VARIANCE_OF_PITCH = 3  # in `HeadPose.covariance_deg2`
STATUSES = ("tracking", "out_of_range")


@dataclass(frozen=True, eq=False)
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

    @cached_property
    def row(self) -> bytes:
        """What the frame shows in numbers: `ROW`, packed."""
        return struct.pack(f"{len(ROW)}d", self.at_ns, *self._of_hand(), *self._of_head(), *self._of_place())

    def _of_hand(self) -> tuple[float, ...]:
        told = self.gesture
        if told is None:
            return (NAN,) * len(_OF_HAND)
        kind, side = _place_in(POINTING, self.pointing), _place_in(SIDES, told.hand)
        bearing = _known(told.bearing_deg, told.bearing_sigma_deg)
        elevation = _known(told.elevation_deg, told.elevation_sigma_deg)
        return kind, side, *bearing, float(told.bearing_mirrored), 1.0 if told.bearing_likelihood else NAN, *elevation

    def _of_head(self) -> tuple[float, ...]:
        told = self.pose
        if told is None:
            return (NAN,) * len(_OF_HEAD)
        status, side = _place_in(STATUSES, told.status), _place_in(SIDES, told.side)
        pitch = (NAN, NAN)
        if told.pitch_deg is not None and told.covariance_deg2 is not None:
            pitch = told.pitch_deg, math.sqrt(told.covariance_deg2[VARIANCE_OF_PITCH])
        return status, *_known(told.yaw_deg, told.yaw_sigma_deg), side, *_known(told.beyond_deg), *pitch

    def _of_place(self) -> tuple[float, ...]:
        if self.place is None:
            return (NAN,) * len(_OF_PLACE)
        return self.place.axis_deg, *self.place.position_m[:2]

    @property
    def unclear(self) -> bool:
        """A stroke whose gesture could not be told."""
        return self.gesture is not None and self.gesture.phase == "stroke" and self.gesture.gesture == "none"

    @property
    def not_pointing(self) -> bool:
        """A stroke of an open hand, a wave and the like."""
        return self.gesture is not None and self.gesture.phase == "stroke" and self.gesture.gesture == "other"

    @cached_property
    def curve(self) -> bytes:
        """The gesture stage's likelihood of bearings, packed as `row`; empty where it does not tell it."""
        told = self.gesture.bearing_likelihood if self.gesture is not None else ()
        return struct.pack(f"{len(told)}d", *told)


def _place_in(all_there_are: Sequence[str], one: str | None) -> float:
    return float(all_there_are.index(one)) if one in all_there_are else NAN


def _known(*values: float | None) -> tuple[float, ...]:
    return tuple(NAN if value is None else value for value in values)


@dataclass(frozen=True)
class HandObservation:
    """A pointing stroke: the gesture recognised and, where it could be told, the bearing pointed to and by which hand.

    `mirrored`: the bearing may as well be 180 - bearing, or `mirror` with its sigma, where both were seen from several sides.
    `agreement` is the share of the frames that said so. `likelihood` is that of bearings -180, -175 ... 175, where the stage
    tells it: it then counts instead of bearing and sigma. `elevation_deg` is how high it points, above the horizontal at the
    head, with its sigma.
    """

    gesture: PointingGesture
    bearing_deg: float | None = None
    bearing_sigma_deg: float | None = None
    mirrored: bool = False
    agreement: float = 1.0
    hand: Side | None = None
    likelihood: tuple[float, ...] = ()
    mirror: tuple[float, float] | None = None
    elevation_deg: float | None = None
    elevation_sigma_deg: float | None = None

    def __hash__(self) -> int:
        # Kept curves are looked up by it, for each view in each frame: without the 72 values of the likelihood.
        return hash((self.gesture, self.bearing_deg, self.bearing_sigma_deg, self.agreement, self.hand))

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

    `beyond_deg` is that range, where the stage tells it. `pitch_deg` is up, from the line to the camera; it is only there with
    a sigma that the stage states.
    """

    yaw_deg: float | None
    yaw_sigma_deg: float | None = None
    side: Side | None = None
    agreement: float = 1.0
    beyond_deg: float | None = None
    pitch_deg: float | None = None
    pitch_sigma_deg: float | None = None


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
