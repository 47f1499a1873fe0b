"""The evidence on one person: what a frame showed, and what hand and head showed over a stroke."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from deixis_schemas.messages import Gesture, HeadPose, Side, SourceStatus

from .localisation import PersonPlace, wrapped_deg
from .pointing import PointingGesture

NAN = math.nan
POINTING: tuple[PointingGesture, ...] = ("point_left", "point_right", "invisible")
SIDES: tuple[Side, ...] = ("left", "right")

# What a frame shows in numbers, in this order in `Sample.row`. First what it shows or not, 1 or 0 (the first is always 1); then
# what is measured, not a number where it does not tell. Hand and head stand in one order: a direction, a height, their sigmas.
HANDS, TURNED = ("left_hand", "right_hand"), ("turned_left", "turned_right")
_HAND_FLAGS = (*POINTING, *HANDS, "mirrored", "has_curve")
_HEAD_FLAGS = ("tracking", "out_of_range", *TURNED, "has_pitch")
FLAGS = ("frame", *_HAND_FLAGS, *_HEAD_FLAGS)
_OF_HAND = ("bearing_deg", "bearing_sigma_deg", "elevation_deg", "elevation_sigma_deg")
_OF_HEAD = ("yaw_deg", "yaw_sigma_deg", "pitch_deg", "pitch_sigma_deg", "beyond_deg")
_OF_PLACE = ("axis_deg", "x_m", "y_m")
ROW = {name: i for i, name in enumerate((*FLAGS, *_OF_HAND, *_OF_HEAD, *_OF_PLACE, "at_ns"))}
VARIANCE_OF_PITCH = 3  # in `HeadPose.covariance_deg2`
_PACKED = struct.Struct(f"{len(ROW)}d")


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
        return self.gesture.gesture if self.gesture.gesture in POINTING else None

    def row(self) -> bytes:
        """What the frame shows in numbers: `ROW`, packed."""
        shown = *self._hand_shown(), *self._head_shown()
        return _PACKED.pack(True, *shown, *self._hand_measured(), *self._head_measured(), *self._placed(), self.at_ns)

    def _hand_shown(self) -> tuple[bool, ...]:
        told, kind = self.gesture, self.pointing
        if told is None:
            return (False,) * len(_HAND_FLAGS)
        kinds = (kind == "point_left", kind == "point_right", kind == "invisible")
        return *kinds, told.hand == "left", told.hand == "right", told.bearing_mirrored, bool(told.bearing_likelihood)

    def _head_shown(self) -> tuple[bool, ...]:
        told = self.pose
        if told is None:
            return (False,) * len(_HEAD_FLAGS)
        has_pitch = told.pitch_deg is not None and told.covariance_deg2 is not None
        return told.status == "tracking", told.status == "out_of_range", told.side == "left", told.side == "right", has_pitch

    def _hand_measured(self) -> tuple[float, ...]:
        told = self.gesture
        if told is None:
            return (NAN,) * len(_OF_HAND)
        return _known(told.bearing_deg, told.bearing_sigma_deg, told.elevation_deg, told.elevation_sigma_deg)

    def _head_measured(self) -> tuple[float, ...]:
        told = self.pose
        if told is None:
            return (NAN,) * len(_OF_HEAD)
        pitch: tuple[float | None, float | None] = (None, None)
        if told.pitch_deg is not None and told.covariance_deg2 is not None:
            pitch = told.pitch_deg, math.sqrt(told.covariance_deg2[VARIANCE_OF_PITCH])
        return _known(told.yaw_deg, told.yaw_sigma_deg, *pitch, told.beyond_deg)

    def _placed(self) -> tuple[float, ...]:
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

    def curve(self) -> bytes:
        """The gesture stage's likelihood of bearings, packed as `row`; empty where it does not tell it."""
        told = self.gesture.bearing_likelihood if self.gesture is not None else ()
        return struct.pack(f"{len(told)}d", *told)


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
