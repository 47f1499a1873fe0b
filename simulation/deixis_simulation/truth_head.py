"""Truth of a head: its angles in the picture and to the camera, where it is, what of the face is seen."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .geometry import Floats, View, wrap_deg
from .label_image import Region
from .pixels import box_around, pixel, rounded

MIRROR: Floats = np.diag([1.0, -1.0, -1.0])
"""From camera axes to those of a head that faces the camera: x to the picture's right, y up, z toward the camera."""


def azimuth_deg(direction: Floats) -> float:
    """Of a world direction, from +Z (toward the camera) to +X (the picture's right)."""
    return math.degrees(math.atan2(direction[0], direction[2]))


def elevation_deg(direction: Floats) -> float:
    """Of a world direction above the floor."""
    return math.degrees(math.atan2(direction[1], math.hypot(direction[0], direction[2])))


def toward_camera_deg(head_centre: Floats, view: View) -> float:
    """Azimuth, in the world, of the direction that all azimuths at this person are measured from."""
    return azimuth_deg(view.centre - head_centre)


def head_truth(rotation: Floats, centre: Floats, eyes: Floats, view: View) -> dict[str, Any]:
    """Of `head` in a person's labels. `rotation` (3, 3): world from the head, identity where it faces +Z."""
    in_camera = MIRROR @ view.rotation @ rotation
    forward = rotation[:, 2]
    ray = view.centre - centre
    off_axis = math.degrees(math.acos(min(max(float(forward @ ray / np.linalg.norm(ray)), -1.0), 1.0)))
    return {
        "yaw_deg": round(math.degrees(math.atan2(in_camera[0, 2], in_camera[2, 2])), 3),
        "pitch_deg": round(math.degrees(math.asin(min(max(in_camera[1, 2], -1.0), 1.0))), 3),
        "roll_deg": round(math.degrees(math.atan2(-in_camera[1, 0], in_camera[1, 1])), 3),
        "yaw_rel_deg": round(wrap_deg(azimuth_deg(forward) - toward_camera_deg(centre, view)), 3),
        "off_axis_deg": round(off_axis, 2),
        "R_cam": rounded(in_camera.ravel(), 5),
        "center_px": pixel(centre, view, 2),
        "center_cam": rounded(view.in_camera(centre), 4),
        "eyes_px": pixel(eyes, view, 2),
    }


def face_truth(face: Floats, head: Floats, seen: Region, view: View) -> dict[str, Any]:
    """Of `face`: boxes around the vertices (n, 3) of face and head, hidden or not, and what is seen of the face."""
    return {
        "bbox_amodal": box_around(face, view),
        "bbox_head": box_around(head, view),
        "bbox_visible": seen.box,
        "visible_px": seen.pixels,
        "centroid_visible_px": seen.centroid,
    }
