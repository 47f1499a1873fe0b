"""How high hand and head go: shelves one above the other, which bearings do not tell apart.

The gesture stage measures the hand's elevation above the horizontal, with its sigma. The head's pitch is measured from the
line to the camera, so it is turned into an angle above the horizontal first. It says little: of a look up or down the eyes do
as much as the head, and heads are held differently. So its likelihood is broad, has a large tail, and is only used where the
stage states how sure it is; a pitch of large sigma then says as good as nothing.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .config import HandConfig, HeadConfig
from .evidence import HandObservation, HeadObservation
from .localisation import PersonPlace

Values = npt.NDArray[np.float64]
GAIN_STEPS = 8
# Angles that a head may be pitched to, and an arm raised to, anywhere: the tail is spread over them.
PITCHES_DEG, ELEVATIONS_DEG = 120.0, 120.0


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


def hand_likelihoods(
    hand: HandObservation, place: PersonPlace, points_m: Values, extent_m: Values, config: HandConfig
) -> Values | None:
    """P(the hand's elevation | the person means the point), for each beside one where it fits best: 0 to 1 (n).

    None where the elevation is not measured.
    """
    if hand.elevation_deg is None or hand.elevation_sigma_deg is None:
        return None
    sigma = np.hypot(max(hand.elevation_sigma_deg, config.sigma_floor_deg), _across(place, points_m, extent_m))
    hit = np.exp(-0.5 * ((hand.elevation_deg - elevations(place, points_m)) / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))
    return _with_tail(hit, sigma, config.elevation_outlier, ELEVATIONS_DEG)


def head_likelihoods(
    head: HeadObservation, place: PersonPlace, points_m: Values, extent_m: Values, config: HeadConfig
) -> Values | None:
    """P(the head's elevation | the person means the point), for each beside one where it fits best: 0 to 1 (n).

    None where the elevation is not measured. Points have a size across (n), metres, of which any part may be looked at.
    """
    seen = elevation_of_head(head, place)
    if seen is None:
        return None
    meant, across = elevations(place, points_m), _across(place, points_m, extent_m)
    sigma = np.sqrt((head.pitch_sigma_deg or 0.0) ** 2 + config.pitch_sigma_deg**2 + across**2)
    gains = np.linspace(config.pitch_gain_min, config.pitch_gain_max, GAIN_STEPS)[:, None]
    hit = (np.exp(-0.5 * ((seen - gains * meant) / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))).mean(axis=0)
    return _with_tail(hit, sigma, config.pitch_outlier, PITCHES_DEG)


def _across(place: PersonPlace, points_m: Values, extent_m: Values) -> Values:
    """How far apart, degrees (standard deviation), the parts of points of such a size look from there (n)."""
    away = np.maximum(np.linalg.norm(points_m - np.array(place.position_m), axis=1), extent_m / 2 + 1e-3)
    return np.asarray(np.degrees(np.arctan2(extent_m / math.sqrt(12), away)))


def _with_tail(hit: Values, sigma: Values, outlier: float, spread_deg: float) -> Values:
    """Densities (n) of angles that are nonsense with that probability, beside the best that there can be."""
    best, tail, told = 1 / (sigma * math.sqrt(2 * math.pi)), outlier / spread_deg, 1 - outlier
    return np.asarray((told * hit + tail) / (told * best + tail))
