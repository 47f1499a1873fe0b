"""A site as its robot finds it at the start: camera, POIs and walls in the robot's own frame, as a scene needs them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from deixis_camera.calibration import AssumedFieldOfView, Calibration, CalibrationError, Intrinsics, load_calibration
from deixis_camera.config import CameraConfig
from deixis_fusion.config import FusionConfig
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.ellipsoid_head import FARTHEST_DEG
from deixis_runtime.occupancy_map import wall_lines
from deixis_runtime.settings import StageConfig
from deixis_runtime.site import Site, SiteError, SitePoi
from deixis_schemas.codec import say
from pydantic import ValidationError

from ..scene import Camera

Point = tuple[float, float]
Position = tuple[float, float, float]
Wall = tuple[Point, Point]
C = TypeVar("C", bound=StageConfig)

USUAL_SIZE = (640, 480)
"""Of a camera that neither a calibration nor a setting gives a size."""
USUAL_FPS = 30
WIDEST_DEG, NARROWEST_DEG = 120.0, 20.0
FARTHEST_M = 60.0
"""Of POIs that a scene can hold; nobody points at what is farther."""
MOST_POIS = 256
MOST_WALLS_DRAWN = 200


class RehearsalError(ValueError):
    """A site that cannot be rehearsed; the text says why and what would help."""


@dataclass(frozen=True)
class RobotFrame:
    """Pose of the robot at the start in the site's map: metres, degrees counter-clockwise."""

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_deg: float = 0.0

    def of_map(self, point: Point) -> Point:
        """A point of the site's map in the robot's frame."""
        return _turned((point[0] - self.x_m, point[1] - self.y_m), -self.yaw_deg)

    def to_map(self, point: Point) -> Point:
        """A point of the robot's frame in the site's map."""
        x, y = _turned(point, self.yaw_deg)
        return x + self.x_m, y + self.y_m


@dataclass(frozen=True)
class GroundPoi:
    """A POI in the robot's frame; `name` is what people call it."""

    poi_id: str
    name: str
    position_m: Position

    @property
    def on_floor(self) -> Point:
        """Where it stands, seen from above."""
        return self.position_m[0], self.position_m[1]


@dataclass(frozen=True)
class Ground:
    """All of a site that a rehearsal needs, in the robot's frame at the start.

    pinhole_px: focal length of the pinhole that must stand in for the site's own calibration, for the renderer draws no
    distortion; none where the camera stage reads the clips as they are. too_far: POIs that are left out.
    clearance_m: fusion's `place.wall_clearance_m`. head_range_deg: to which yaw headpose tells heads.
    notes: sentences on what is drawn otherwise than the site is.
    """

    name: str
    camera: Camera
    fps: int
    pois: tuple[GroundPoi, ...]
    walls: tuple[Wall, ...]
    frame: RobotFrame
    clearance_m: float
    head_range_deg: float
    pinhole_px: float | None = None
    too_far: tuple[GroundPoi, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def camera_foot(self) -> Point:
        """The optical centre, seen from above."""
        return self.camera.position_m[0], self.camera.position_m[1]


def ground_of(site: Site) -> Ground:
    """What a rehearsal needs of a site. Raises RehearsalError where it has no POIs, or settings that the stages refuse."""
    if not site.pois:
        raise RehearsalError(f"site file {site.path}: pois: there are none, so there is nothing to point at")
    if len(site.pois) > MOST_POIS:
        raise RehearsalError(f"site file {site.path}: pois: a rehearsal takes {MOST_POIS} at most, not {len(site.pois)}")
    settings = _settings(CameraConfig, {**site.settings.get("camera", {}), **site.camera}, site.path)
    fusion = _settings(FusionConfig, site.settings.get("fusion", {}), site.path)
    camera, pinhole_px, notes = _camera(settings, site.path)
    frame = RobotFrame(site.robot_pose.x_m, site.robot_pose.y_m, site.robot_pose.yaw_deg)
    pois = [_poi(poi, frame) for poi in site.pois]
    near = tuple(poi for poi in pois if math.hypot(*poi.on_floor) <= FARTHEST_M and abs(poi.position_m[2]) <= FARTHEST_M)
    if not near:
        raise RehearsalError(
            f"site file {site.path}: pois: all are beyond {FARTHEST_M:g} m from the robot; is robot_pose right?"
        )
    try:
        walls = wall_lines(site)
    except SiteError as error:
        raise RehearsalError(str(error)) from None
    if len(walls) > MOST_WALLS_DRAWN:
        notes.append(f"of {len(walls)} walls the {MOST_WALLS_DRAWN} nearest are drawn; all of them hide POIs")
    return Ground(
        name=site.name or site.path.stem,
        camera=camera,
        fps=max(1, min(USUAL_FPS, round(settings.rate_hz or USUAL_FPS))),
        pois=near,
        walls=tuple((frame.of_map(a), frame.of_map(b)) for a, b in walls),
        frame=frame,
        clearance_m=fusion.place.wall_clearance_m,
        head_range_deg=_head_range_deg(_settings(HeadposeConfig, site.settings.get("headpose", {}), site.path)),
        pinhole_px=pinhole_px,
        too_far=tuple(poi for poi in pois if poi not in near),
        notes=tuple(notes),
    )


def _settings(model: type[C], content: Mapping[str, Any], path: Path) -> C:
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise RehearsalError(f"site file {path}: {say(error)}") from None


def _head_range_deg(settings: HeadposeConfig) -> float:
    return settings.range_deg if settings.method == "regression" else min(settings.range_deg, FARTHEST_DEG)


def _poi(poi: SitePoi, frame: RobotFrame) -> GroundPoi:
    x, y = frame.of_map((poi.position_m[0], poi.position_m[1]))
    return GroundPoi(poi.poi_id, poi.name or poi.poi_id, (x, y, poi.position_m[2]))


def _camera(settings: CameraConfig, path: Path) -> tuple[Camera, float | None, list[str]]:
    """The scene's camera, the focal length of a pinhole that must replace the calibration, and notes."""
    calibration, size = _calibration(settings, path)
    width, height = _scaled(size, settings.max_width)
    try:
        intrinsics = calibration.for_size(width, height)
    except CalibrationError as error:
        raise RehearsalError(str(error)) from None
    focal = intrinsics.camera_matrix[0]
    fov = round(math.degrees(2 * math.atan(width / 2 / focal)), 4)
    drawn = min(max(fov, NARROWEST_DEG), WIDEST_DEG)
    notes = []
    if drawn != fov:
        notes.append(f"the camera is {fov:.0f} degrees wide; the rehearsal draws {drawn:.0f}")
    elif not _is_pinhole(intrinsics, width, height):
        notes.append("the calibration's distortion is not drawn: the rehearsal's camera is a pinhole as wide as yours")
    mount = settings.mount
    try:
        camera = Camera(
            width=width,
            height=height,
            horizontal_fov_deg=drawn,
            position_m=mount.position_m,
            yaw_deg=mount.yaw_deg,
            pitch_up_deg=mount.pitch_up_deg,
            roll_deg=mount.roll_deg,
        )
    except ValidationError as error:
        raise RehearsalError(f"site file {path}: camera.mount cannot be rehearsed: {say(error)}") from None
    return camera, camera.focal_px if notes else None, notes


def _calibration(settings: CameraConfig, path: Path) -> tuple[Calibration, tuple[int, int]]:
    if settings.calibration is None:
        size = settings.width or USUAL_SIZE[0], settings.height or USUAL_SIZE[1]
        return AssumedFieldOfView(settings.horizontal_fov_deg), size
    try:
        found = load_calibration(path.parent / settings.calibration)
    except CalibrationError as error:
        raise RehearsalError(str(error)) from None
    return found, (found.width, found.height)


def _scaled(size: tuple[int, int], longest_px: int) -> tuple[int, int]:
    """As the camera stage scales: the stages see no larger picture, so none has to be rendered. Even, as H.264 wants it."""
    share = min(1.0, longest_px / max(size))
    width, height = (max(2, 2 * round(side * share / 2)) for side in size)
    return width, height


def _is_pinhole(intrinsics: Intrinsics, width: int, height: int) -> bool:
    fx, _, cx, _, fy, cy, *_ = intrinsics.camera_matrix
    centred = abs(cx - (width - 1) / 2) < 1 and abs(cy - (height - 1) / 2) < 1
    return centred and abs(fx / fy - 1) < 0.005 and not any(intrinsics.distortion)


def _turned(point: Point, angle_deg: float) -> Point:
    cos, sin = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return cos * point[0] - sin * point[1], sin * point[0] + cos * point[1]
