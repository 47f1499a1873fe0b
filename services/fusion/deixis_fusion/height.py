"""How high the head looks: shelves one above the other, which bearings do not tell apart.

The head's pitch is measured from the line to the camera, so it is turned into an angle above the horizontal first. It says
little: of a look up or down the eyes do as much as the head, and heads are held differently. So its likelihood is broad, has a
large tail, and is only used where the stage states how sure it is; a pitch of large sigma then says as good as nothing.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .config import HeadConfig
from .evidence import HeadObservation
from .localisation import PersonPlace

Values = npt.NDArray[np.float64]
GAIN_STEPS = 8
# Angles that a head may be pitched to, anywhere: the tail is spread over them.
PITCHES_DEG = 120.0


def elevation_of_head(head: HeadObservation, place: PersonPlace) -> float | None:
    """Angle of the head's direction above the horizontal, degrees; none where pitch, its sigma or yaw is not known."""
    if head.yaw_deg is None or head.pitch_deg is None or head.pitch_sigma_deg is None:
        return None
    yaw, pitch, roll = math.radians(head.yaw_deg), math.radians(head.pitch_deg), math.radians(place.camera_roll_deg)
    camera = math.radians(elevations(place, np.array([place.camera_m]))[0])
    # Of the head's direction: the parts to the camera, to the picture's right and to its top, which a rolled camera turns.
    ahead, right, top = math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch)
    up = ahead * math.sin(camera) + (top * math.cos(roll) - right * math.sin(roll)) * math.cos(camera)
    return math.degrees(math.asin(min(1.0, max(-1.0, up))))


def elevations(place: PersonPlace, points_m: Values) -> Values:
    """Angles of points (n, 3), map frame, above the horizontal at the person's head, degrees (n)."""
    away = np.hypot(points_m[:, 0] - place.position_m[0], points_m[:, 1] - place.position_m[1])
    return np.degrees(np.arctan2(points_m[:, 2] - place.position_m[2], np.maximum(away, 1e-3)))


def likelihoods(
    head: HeadObservation, place: PersonPlace, points_m: Values, extent_m: Values, config: HeadConfig
) -> Values | None:
    """P(the head's elevation | the person means the point), for each beside one where it fits best: 0 to 1 (n).

    None where the elevation is not measured. Points have a size across (n), metres, of which any part may be looked at.
    """
    seen = elevation_of_head(head, place)
    if seen is None:
        return None
    meant = elevations(place, points_m)
    away = np.maximum(np.linalg.norm(points_m - np.array(place.position_m), axis=1), extent_m / 2 + 1e-3)
    across = np.degrees(np.arctan2(extent_m / math.sqrt(12), away))
    sigma = np.sqrt((head.pitch_sigma_deg or 0.0) ** 2 + config.pitch_sigma_deg**2 + across**2)
    gains = np.linspace(config.pitch_gain_min, config.pitch_gain_max, GAIN_STEPS)[:, None]
    hit = (np.exp(-0.5 * ((seen - gains * meant) / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))).mean(axis=0)
    best, tail = 1 / (sigma * math.sqrt(2 * math.pi)), config.pitch_outlier / PITCHES_DEG
    told = 1 - config.pitch_outlier
    return np.asarray((told * hit + tail) / (told * best + tail))
