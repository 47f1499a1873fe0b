"""Who is seen where, as ROS4HRI says it: faces and bodies with their boxes, and where a face looks. Pure.

A body is here what we see of one: the face and hands of a person. There is no skeleton to tell of.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from deixis_runtime.lens import Lens
from deixis_runtime.mount import Vector, to_base
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import CameraMount, HeadPose, Track, Tracks

from .targets import person_name

Quaternion = tuple[float, float, float, float]
NARROWEST_FACE_PX = 2.0
SHORTEST = 1e-6


@dataclass(frozen=True)
class Box:
    """Corners as shares of the picture's width and height, 0 to 1; `confidence` too."""

    xmin: float
    ymin: float
    xmax: float
    ymax: float
    confidence: float


@dataclass(frozen=True)
class People:
    """Boxes by id of who is seen in one frame."""

    faces: dict[str, Box]
    bodies: dict[str, Box]


@dataclass(frozen=True)
class HeadPlace:
    """A head in the camera's optical frame, metres and quaternions (x, y, z, w).

    face: x out of the face, z up. gaze: z along the look, y down.
    """

    position_m: Vector
    face: Quaternion
    gaze: Quaternion


def people_of(tracks: Tracks) -> People:
    """The persons of a frame; tracks that belong to nobody are left out."""
    by_person: dict[int, list[Track]] = {}
    for track in tracks.tracks:
        if track.person_id is not None and track.kind != "unknown":
            by_person.setdefault(track.person_id, []).append(track)
    faces = {
        person_name(person_id): _box([track], tracks)
        for person_id, theirs in by_person.items()
        for track in theirs
        if track.kind == "face"
    }
    bodies = {person_name(person_id): _box(theirs, tracks) for person_id, theirs in by_person.items()}
    return People(faces, bodies)


def head_places(tracks: Tracks, poses: Iterable[HeadPose], lens: Lens, mount: CameraMount) -> dict[str, HeadPlace]:
    """Where the heads are, and whereto they are turned, of all whose yaw is known. They are taken to be upright."""
    yaws = {pose.person_id: pose for pose in poses if pose.status == "tracking" and pose.yaw_deg is not None}
    places = {}
    for track in tracks.tracks:
        pose = yaws.get(track.person_id) if track.kind == "face" and track.person_id is not None else None
        if pose is None or pose.yaw_deg is None or track.person_id is None:
            continue
        place = _place(track, pose.face_width_px, pose.yaw_deg, (tracks.width, tracks.height), lens, mount)
        if place is not None:
            places[person_name(track.person_id)] = place
    return places


def _place(
    track: Track, face_width_px: float | None, yaw_deg: float, size: tuple[int, int], lens: Lens, mount: CameraMount
) -> HeadPlace | None:
    left, top, width, height = track.bbox_px
    width_px = face_width_px or width
    if width_px < NARROWEST_FACE_PX:
        return None
    depth = lens.focal_x_px(size) * FACE_WIDTH_M / width_px
    x, y = lens.ray((left + width / 2, top + height / 2), size)
    position = (x * depth, y * depth, depth)
    up: Vector = tuple(to_base(axis, mount)[2] for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))  # type: ignore[assignment]
    gaze = _turned(_horizontal((-position[0], -position[1], -position[2]), up), up, yaw_deg)
    if gaze is None:
        return None
    left_hand, down = _cross(up, gaze), (-up[0], -up[1], -up[2])
    return HeadPlace(position, _quaternion(gaze, left_hand, up), _quaternion(_cross(down, gaze), down, gaze))


def _box(tracks: list[Track], picture: Tracks) -> Box:
    lefts, tops, widths, heights = zip(*(track.bbox_px for track in tracks), strict=True)
    rights = [left + width for left, width in zip(lefts, widths, strict=True)]
    bottoms = [top + height for top, height in zip(tops, heights, strict=True)]
    confidence = min(track.confidence for track in tracks)
    return Box(
        _share(min(lefts), picture.width),
        _share(min(tops), picture.height),
        _share(max(rights), picture.width),
        _share(max(bottoms), picture.height),
        _share(confidence, 1),
    )


def _share(value: float, whole: int) -> float:
    return min(1.0, max(0.0, value / whole))


def _horizontal(vector: Vector, up: Vector) -> Vector | None:
    """The part of a vector across `up`, of length 1; None where it has none."""
    along = sum(a * b for a, b in zip(vector, up, strict=True))
    x, y, z = (a - along * b for a, b in zip(vector, up, strict=True))
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length > SHORTEST else None


def _turned(vector: Vector | None, up: Vector, angle_deg: float) -> Vector | None:
    """A vector across `up`, turned about it counter-clockwise as seen from above."""
    if vector is None:
        return None
    cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    across = _cross(up, vector)
    x, y, z = (a * cosine + b * sine for a, b in zip(vector, across, strict=True))
    return x, y, z


def _cross(one: Vector, other: Vector) -> Vector:
    (a, b, c), (d, e, f) = one, other
    return b * f - c * e, c * d - a * f, a * e - b * d


def _quaternion(x: Vector, y: Vector, z: Vector) -> Quaternion:
    """The turn (x, y, z, w) whose axes these are, found by its largest part: nothing is divided by 0."""
    trace_parts = (x[0] - y[1] - z[2], y[1] - x[0] - z[2], z[2] - x[0] - y[1], x[0] + y[1] + z[2])
    largest = max(range(4), key=lambda index: trace_parts[index])
    root = math.sqrt(max(0.0, 1 + trace_parts[largest])) / 2
    products = {
        0: (4 * root * root, x[1] + y[0], z[0] + x[2], y[2] - z[1]),
        1: (x[1] + y[0], 4 * root * root, y[2] + z[1], z[0] - x[2]),
        2: (z[0] + x[2], y[2] + z[1], 4 * root * root, x[1] - y[0]),
        3: (y[2] - z[1], z[0] - x[2], x[1] - y[0], 4 * root * root),
    }[largest]
    a, b, c, d = (product / (4 * root) for product in products)
    return a, b, c, d
