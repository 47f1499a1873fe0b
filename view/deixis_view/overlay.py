"""What the stages see, over the picture: faces and hands with their outlines, fingertips, where the head turns, the POIs."""

from __future__ import annotations

import math

import cv2
import numpy as np
from deixis_runtime.mount import to_base
from deixis_schemas.messages import CameraInfo, Gestures, HeadPose, RobotPose, Track, Tracks

from . import colours
from .drawing import Arrows, Boxes, Dots, Drawing, Lines, Point2
from .floor import camera_place, chances
from .frame_view import FrameView
from .known import Known
from .pictures import scale

ROOT = "picture"
MOST_CORNERS = 160
"""Of an outline as it is drawn."""
FINGERTIP_RADIUS_PX = 3.0
YAW_ARROW = 2.2
"""Length of a head's arrow when turned by 90 degrees, in widths of the face."""
NEAREST_M = 0.3


def draw_overlay(view: FrameView, known: Known, by: float) -> list[Drawing]:
    """All that is drawn over the picture. by: the scale of the picture as it is shown to the frame."""
    tracks = view.tracks.tracks if view.tracks else []
    poses = {pose.person_id: pose for pose in view.poses.poses} if view.poses else {}
    return [
        Drawing(f"{ROOT}/edge", _edge(view.tracks, by)),
        Drawing(f"{ROOT}/tracks", _boxes(tracks, poses, by)),
        Drawing(f"{ROOT}/contours", _contours(tracks, by)),
        Drawing(f"{ROOT}/fingertips", _fingertips(view.gestures, by)),
        Drawing(f"{ROOT}/yaw", _yaws(tracks, poses, by)),
        Drawing(f"{ROOT}/pois", _pois(view, known, by)),
    ]


def size_shown(known: Known, width: int) -> tuple[float, float] | None:
    """Width and height of the pictures as they are shown, at most `width` across; none before the camera has told."""
    camera = known.camera
    if camera is None or not camera.width:
        return None
    by = scale(camera.width, width)
    return camera.width * by, camera.height * by


def outline(contour: bytes) -> list[Point2]:
    """The corners of a packed outline, closed; some of them where there are many."""
    corners = np.frombuffer(contour, "<i2").reshape(-1, 2)
    step = max(1, math.ceil(len(corners) / MOST_CORNERS))
    strip = [(float(x), float(y)) for x, y in corners[::step]]
    return [*strip, strip[0]] if strip else []


def _edge(tracks: Tracks | None, by: float) -> Lines:
    """The frame's edge: all that is there of a picture that may not be shown."""
    if tracks is None:
        return Lines()
    right, bottom = tracks.width * by, tracks.height * by
    return Lines([[(0, 0), (right, 0), (right, bottom), (0, bottom), (0, 0)]], [1.0], [], [colours.WALL])


def _boxes(tracks: list[Track], poses: dict[int, HeadPose], by: float) -> Boxes:
    boxes = Boxes()
    for track in tracks:
        x, y, width, height = (value * by for value in track.bbox_px)
        boxes.xywh.append((x, y, width, height))
        boxes.colours.append(colours.KINDS[track.kind])
        boxes.labels.append(_label(track, poses.get(track.person_id) if track.person_id is not None else None))
    return boxes


def _label(track: Track, pose: HeadPose | None) -> str:
    what = track.kind.replace("_", " ") + ("" if track.observed else " (predicted)")
    if track.kind != "face" or pose is None:
        return what
    # Short: a label is broken into lines as wide as its box.
    return pose.status.replace("_", " ") if pose.yaw_deg is None else f"{pose.yaw_deg:+.0f}°"


def _contours(tracks: list[Track], by: float) -> Lines:
    lines = Lines()
    for track in tracks:
        strip = [(x * by, y * by) for x, y in outline(track.contour)]
        if strip:
            lines.strips.append(strip)
            lines.widths.append(2.0)
            lines.colours.append(colours.KINDS[track.kind])
    return lines


def _fingertips(gestures: Gestures | None, by: float) -> Dots:
    tips = [(x * by, y * by) for gesture in (gestures.gestures if gestures else []) for x, y in gesture.fingertips_px]
    return Dots(tips, [FINGERTIP_RADIUS_PX] * len(tips), [], [colours.FINGERTIP] * len(tips))


def _yaws(tracks: list[Track], poses: dict[int, HeadPose], by: float) -> Arrows:
    """From each face whither it turns, as seen from above: to the side by the sine of the yaw, down where it faces us."""
    arrows = Arrows()
    for track in tracks:
        pose = poses.get(track.person_id) if track.kind == "face" and track.person_id is not None else None
        if pose is None or pose.yaw_deg is None:
            continue
        x, y, width, height = (value * by for value in track.bbox_px)
        yaw = math.radians(pose.yaw_deg)
        arrows.origins.append((x + width / 2, y + height / 2))
        arrows.vectors.append((YAW_ARROW * width * math.sin(yaw), 0.5 * width * math.cos(yaw)))
        arrows.colours.append(colours.FINGERTIP)
    return arrows


def _pois(view: FrameView, known: Known, by: float) -> Dots:
    """The POIs that lie in the picture, where the camera's pose and lens put them."""
    camera, pose = known.camera, known.robot
    dots = Dots()
    if camera is None or camera.camera_matrix is None or pose is None or not (camera.width and known.pois):
        return dots
    matrix = np.array(camera.camera_matrix).reshape(3, 3)
    chance_of = chances(view.belief)
    seen = view.frame or view.tracks
    by *= seen.width / camera.width if seen is not None else 1.0  # a camera sends less of it where the link is bad
    for poi, pixel in zip(known.pois.values(), _projected(known, camera, pose, matrix), strict=True):
        if pixel is not None:
            chance = chance_of.get(poi.poi_id, 0.0)
            dots.points.append((pixel[0] * by, pixel[1] * by))
            dots.radii.append(3.0 + 4.0 * chance)
            dots.colours.append(colours.of_belief(chance))
            dots.labels.append(poi.name or poi.poi_id)
    return dots


def _projected(known: Known, camera: CameraInfo, pose: RobotPose, matrix: np.ndarray) -> list[Point2 | None]:
    """Pixels of the POIs in their order; none of those that the camera does not see."""
    at, _ = camera_place(pose, camera)
    centre = np.array([*at, camera.mount.position_m[2]])
    axes = _optical_axes(camera, pose)
    points = np.array([poi.position_m for poi in known.pois.values()]) - centre
    optical = points @ axes.T
    flat = np.zeros(3)
    ahead = np.maximum(optical, [-np.inf, -np.inf, NEAREST_M])[:, None, :]
    bent = np.array(camera.distortion)
    if camera.distortion_model == "equidistant":
        pixels, _ = cv2.fisheye.projectPoints(ahead, flat, flat, matrix, bent[:4])
    else:
        pixels, _ = cv2.projectPoints(ahead, flat, flat, matrix, bent if len(bent) else None)
    # Far outside of the picture a polynomial of the lens comes back into it.
    wide = np.abs(optical[:, 0] / np.maximum(optical[:, 2], NEAREST_M)) < 2 * camera.width / matrix[0, 0]
    inside = [
        z > NEAREST_M and near and 0 <= u < camera.width and 0 <= v < camera.height
        for z, near, (u, v) in zip(optical[:, 2], wide, pixels[:, 0], strict=True)
    ]
    return [(float(u), float(v)) if seen else None for seen, (u, v) in zip(inside, pixels[:, 0], strict=True)]


def _optical_axes(camera: CameraInfo, pose: RobotPose) -> np.ndarray:
    """The optical frame's axes, right, down and ahead, as rows in the map frame."""
    heading = math.radians(pose.yaw_deg)
    turned = np.array([[math.cos(heading), -math.sin(heading), 0], [math.sin(heading), math.cos(heading), 0], [0, 0, 1]])
    return np.array([turned @ to_base(axis, camera.mount) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))])
