"""Truth of hands and of the arm that gestures."""

from __future__ import annotations

from typing import Any

import numpy as np

from .actor import Moment
from .geometry import Floats, View, wrap_deg
from .label_image import Region
from .pixels import box_around, pixel, rounded
from .scene import ArmSide
from .truth_head import azimuth_deg, elevation_deg

OUTSIDE_SHARE = 1 / 32
"""A hand whose middle is this share of the width beyond the picture counts as in it still (20 pixels at VGA)."""


def hand_truth(
    moment: Moment, side: ArmSide, vertices: Floats, weights: Floats, seen: Region, view: View, before_px: list[float] | None
) -> dict[str, Any]:
    """Of one hand. `vertices` (n, 3) of its surface, `weights` (n,) by area; `before_px`: its middle one frame ago."""
    centre = weights @ vertices / weights.sum()
    middle = pixel(centre, view)
    speed = None if before_px is None else round(float(np.hypot(middle[0] - before_px[0], middle[1] - before_px[1])), 2)
    return {
        "center_px": middle,
        "center_cam": rounded(view.in_camera(centre), 4),
        "bbox_amodal": box_around(vertices, view),
        "bbox_visible": seen.box,
        "visible_px": seen.pixels,
        "centroid_visible_px": seen.centroid,
        "index_tip_px": pixel(moment.fingertip[side], view),
        "index_tip_cam": rounded(view.in_camera(moment.fingertip[side]), 4),
        "wrist_px": pixel(moment.wrist[side], view),
        "speed_px": speed,
        "in_frame": in_frame(centre, middle, view),
    }


def in_frame(point: Floats, middle_px: list[float], view: View) -> bool:
    """Whether a point is before the camera and in the picture, or hardly outside."""
    edge = OUTSIDE_SHARE * view.width
    x, y = middle_px
    return bool(view.in_camera(point)[2] > 0 and -edge < x < view.width + edge and -edge < y < view.height + edge)


def arm_truth(moment: Moment, toward_camera_deg: float) -> dict[str, Any]:
    """Of `arm`: the gesturing one; empty while none gestures. Angles as everywhere from the direction to the camera."""
    side = moment.arm_side
    if side is None:
        return {}
    tip, shoulder = moment.fingertip[side], moment.shoulder[side]
    index = tip - moment.index_base[side]
    ways = {
        "azimuth_deg": tip - shoulder,
        "eye_tip_azimuth_deg": tip - moment.eyes,
        "index_azimuth_deg": index,
        "forearm_azimuth_deg": moment.wrist[side] - moment.elbow[side],
    }
    azimuths = {name: round(wrap_deg(azimuth_deg(way) - toward_camera_deg), 2) for name, way in ways.items()}
    elevations = {
        "elevation_deg": round(elevation_deg(tip - shoulder), 2),
        "index_elevation_deg": round(elevation_deg(index), 2),
    }
    return {"side": side, **azimuths, **elevations}
