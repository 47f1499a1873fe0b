"""Where a person is in the map, and at which bearing the person sees a POI.

Frames by REP-103 and REP-105: optical x right, y down, z forward; `base_link` and map x forward, y left, z up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

from deixis_runtime.lens import Lens
from deixis_runtime.mount import Vector, to_base
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import CameraInfo, CameraMount, HeadPose, Track, Tracks

from .config import PlaceConfig

# What a message can say of a position, to either side of the map's origin.
FARTHEST_M = 1e5


@dataclass(frozen=True)
class RobotPlace:
    """Pose of `base_link` in the map frame: metres, degrees counter-clockwise."""

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_deg: float = 0.0


@dataclass(frozen=True)
class Camera:
    """How the camera projects, and where it is mounted."""

    lens: Lens
    mount: CameraMount

    @staticmethod
    def of(info: CameraInfo) -> Camera:
        """The camera that this message tells of. Raises LensError where it has no intrinsics, or none that can be."""
        return Camera(Lens.of(info), info.mount)


@dataclass(frozen=True)
class HeadSighting:
    """A head in a picture: its centre, the size (width, height) of the picture, and its depth along the optical axis."""

    centre_px: tuple[float, float]
    image_size: tuple[int, int]
    depth_m: float


@dataclass(frozen=True)
class PersonPlace:
    """A person's head in the map, and the camera as the person sees it; `camera_roll_deg` as in `CameraMount`."""

    position_m: Vector
    camera_m: Vector
    distance_m: float
    sigma_m: float
    camera_roll_deg: float = 0.0

    @cached_property
    def axis_deg(self) -> float:
        """Direction from the person to the camera, where bearings are 0: degrees counter-clockwise from the map's x axis."""
        ahead, left = self.camera_m[0] - self.position_m[0], self.camera_m[1] - self.position_m[1]
        return math.degrees(math.atan2(left, ahead))


def locate(camera: Camera, robot: RobotPlace, head: HeadSighting, sigma: float) -> PersonPlace:
    """Place in the map of a head as sighted; `sigma` is the relative standard deviation of its depth."""
    x, y = camera.lens.ray(head.centre_px, head.image_size)
    ray = (x * head.depth_m, y * head.depth_m, head.depth_m)
    centre = _to_map(camera.mount.position_m, robot)
    position = _to_map(_add(camera.mount.position_m, to_base(ray, camera.mount)), robot)
    distance = math.dist(position, centre)
    roll = camera.mount.roll_deg
    return PersonPlace(position, centre, distance, sigma_m=distance * sigma, camera_roll_deg=roll)


def depth_of_face(lens: Lens, width_px: float, image_size: tuple[int, int]) -> float:
    """Distance along the optical axis, metres, of a face `width_px` wide from ear to ear in a picture of that size."""
    return lens.focal_x_px(image_size) * FACE_WIDTH_M / width_px


def bearing_deg(place: PersonPlace, target_m: Vector) -> float:
    """Bearing of a point at the person: from the direction person -> camera, positive toward the image's right.

    That is counter-clockwise seen from above, the person's own left (REP-103); degrees within -180 and 180.
    """
    ax, ay = place.camera_m[0] - place.position_m[0], place.camera_m[1] - place.position_m[1]
    bx, by = target_m[0] - place.position_m[0], target_m[1] - place.position_m[1]
    return math.degrees(math.atan2(ax * by - ay * bx, ax * bx + ay * by))


def wrapped_deg(angle: float) -> float:
    """The same angle within -180 and 180 degrees."""
    return (angle + 180.0) % 360.0 - 180.0


class PersonLocator:
    """Where one person is, from frame to frame. `now_ns` is the time of `RunClock`."""

    def __init__(self, config: PlaceConfig) -> None:
        self._config = config
        self._distance = DistanceFilter(config.distance_time_s)
        self._placed_ns: int | None = None
        self.place: PersonPlace | None = None

    def see(
        self,
        face: Track | None,
        size: tuple[int, int],
        pose: HeadPose | None,
        view: tuple[Camera | None, RobotPlace],
        now_ns: int,
    ) -> None:
        """Take in where the person's face is in a picture of that size; the last place is held where it is not seen.

        `view` is the camera, none while its intrinsics are not known, and where the robot was then.
        """
        camera, robot = view
        if face is not None and camera is not None:
            self.place = self._placed(face, size, pose, camera, robot, now_ns)
            self._placed_ns = now_ns
        elif self._placed_ns is not None and now_ns - self._placed_ns > self._config.hold_s * 1e9:
            self.place = None
        elif self.place is not None and camera is not None:
            # The person is taken to stand still; the camera may have moved.
            centre = _to_map(camera.mount.position_m, robot)
            self.place = replace(self.place, camera_m=centre, distance_m=math.dist(self.place.position_m, centre))

    def _placed(
        self, face: Track, size: tuple[int, int], pose: HeadPose | None, camera: Camera, robot: RobotPlace, now_ns: int
    ) -> PersonPlace | None:
        x, y, box_width, height = face.bbox_px
        # A box is as wide as what it shows: hair, a profile, half a face. A head that was read says better how wide it is.
        read = pose.face_width_px if pose is not None and pose.status == "tracking" else None
        elapsed_s = (now_ns - self._placed_ns) / 1e9 if self._placed_ns is not None else 0.0
        measured = depth_of_face(camera.lens, read or box_width, size)
        depth = self._distance.update(measured, elapsed_s, read is not None or self._is_frontal(pose))
        # Pixel centres are integers: a box from x to x + width - 1 is centred half a pixel before x + width / 2.
        centre = (x + (box_width - 1) / 2, y + (height - 1) / 2)
        place = locate(camera, robot, HeadSighting(centre, size, depth), self._config.distance_sigma)
        return place if all(abs(value) <= FARTHEST_M for value in place.position_m) else None

    def _is_frontal(self, pose: HeadPose | None) -> bool:
        if pose is None or pose.status != "tracking":
            return pose is None or pose.status != "out_of_range"
        return abs(pose.yaw_deg or 0.0) < self._config.frontal_yaw_deg


class DistanceFilter:
    """Smooths one person's depth over time.

    A face that turns away has a box of another width (a profile is up to a fifth narrower or wider), so that depth follows
    slowly while the head is turned, unless its width was read from the head itself.
    """

    TURNED_SLOWDOWN = 8.0

    def __init__(self, time_constant_s: float) -> None:
        self._time_constant_s = time_constant_s
        self._log_depth: float | None = None

    def update(self, depth_m: float, elapsed_s: float, frontal: bool) -> float:
        """Take in one measured depth, `elapsed_s` after the last; returns the smoothed one, metres."""
        measured = math.log(depth_m)
        if self._log_depth is None:
            self._log_depth = measured
            return depth_m
        constant = self._time_constant_s * (1.0 if frontal else self.TURNED_SLOWDOWN)
        share = 1.0 if constant <= 0 else 1 - math.exp(-max(0.0, elapsed_s) / constant)
        self._log_depth += share * (measured - self._log_depth)
        return math.exp(self._log_depth)


def face_of(tracks: Tracks, person_id: int) -> Track | None:
    """The person's face in these tracks: of several, the one believed most. None without a box of some width."""
    faces = [t for t in tracks.tracks if t.person_id == person_id and t.kind == "face" and t.bbox_px[2] >= 1]
    return max(faces, key=lambda track: (track.observed, track.confidence), default=None)


def _to_map(base: Vector, robot: RobotPlace) -> Vector:
    cos, sin = math.cos(math.radians(robot.yaw_deg)), math.sin(math.radians(robot.yaw_deg))
    return robot.x_m + base[0] * cos - base[1] * sin, robot.y_m + base[0] * sin + base[1] * cos, base[2]


def _add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
