"""What was measured while somebody stood at a known spot and pointed at a known POI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from deixis_fusion.localisation import RobotPlace, depth_of_face, face_of
from deixis_fusion.pointing import GESTURES, PointingGesture
from deixis_runtime.lens import Lens
from deixis_runtime.mount import Vector
from deixis_schemas.messages import Gesture, HeadPose, Tracks

DIRECTED_SHARE = 0.3
"""As fusion has it: a side said in so many of the pointing frames is what was said."""


ORIGIN = RobotPlace()


@dataclass(frozen=True)
class Pointing:
    """One pointing. head_m: the head in the camera's optical frame (x right, y down, z forward), however it is mounted.

    gesture: what the hand was read as, none where no pointing was seen. Angles at the person as in the messages, medians; none
    where they were not told. mirrored: the bearing b may be 180 - b. robot: where the robot stood.
    """

    poi_id: str
    spot: str
    head_m: Vector
    gesture: PointingGesture | None = None
    bearing_deg: float | None = None
    bearing_sigma_deg: float | None = None
    mirrored: bool = False
    yaw_deg: float | None = None
    yaw_sigma_deg: float | None = None
    robot: RobotPlace = ORIGIN


@dataclass(frozen=True)
class Frame:
    """What was said of one person in one frame."""

    tracks: Tracks
    pose: HeadPose | None
    gesture: Gesture | None

    @property
    def points(self) -> bool:
        """Whether a pointing stroke is seen."""
        return self.gesture is not None and self.gesture.phase == "stroke" and self.gesture.gesture in GESTURES


def pointing_of(
    poi_id: str, spot: str, person_id: int, frames: Sequence[Frame], lens: Lens, robot: RobotPlace
) -> Pointing | None:
    """One person's frames of one pointing together; none where no face was seen in them."""
    strokes = [frame for frame in frames if frame.points]
    # Where no stroke was seen, the place still tells how the camera is mounted.
    heads = [head for frame in strokes or frames if (head := head_of(frame, person_id, lens)) is not None]
    if not heads:
        return None
    x, y, z = (median(axis) for axis in zip(*heads, strict=True))
    gestures = [frame.gesture for frame in strokes if frame.gesture is not None]
    told = [gesture for gesture in gestures if gesture.bearing_deg is not None]
    poses = [frame.pose for frame in strokes if frame.pose is not None and frame.pose.status == "tracking"]
    return Pointing(
        poi_id,
        spot,
        (x, y, z),
        _vote(gestures),
        _median([gesture.bearing_deg for gesture in told]),
        _median([gesture.bearing_sigma_deg for gesture in told]),
        2 * sum(gesture.bearing_mirrored for gesture in told) > len(told),
        _median([pose.yaw_deg for pose in poses]),
        _median([pose.yaw_sigma_deg for pose in poses]),
        robot,
    )


def head_of(frame: Frame, person_id: int, lens: Lens) -> Vector | None:
    """Where the head is in the optical frame, metres; none where no face is seen."""
    face = face_of(frame.tracks, person_id)
    if face is None:
        return None
    x, y, width, height = face.bbox_px
    size = frame.tracks.width, frame.tracks.height
    read = frame.pose.face_width_px if frame.pose is not None else None
    depth = depth_of_face(lens, read or width, size)
    across, down = lens.ray((x + (width - 1) / 2, y + (height - 1) / 2), size)
    return across * depth, down * depth, depth


def _vote(gestures: Sequence[Gesture]) -> PointingGesture | None:
    if not gestures:
        return None
    counts = {name: sum(gesture.gesture == name for gesture in gestures) for name in GESTURES}
    directed: PointingGesture = "point_left" if counts["point_left"] >= counts["point_right"] else "point_right"
    return directed if counts[directed] >= DIRECTED_SHARE * len(gestures) else "invisible"


def _median(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return median(known) if known else None
