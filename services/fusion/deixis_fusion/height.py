"""How high hand and head go: shelves one above the other, which bearings do not tell apart.

The gesture stage measures the hand's elevation above the horizontal, with its sigma. The head's pitch is measured from the
line to the camera, so it is turned into an angle above the horizontal first. It says little: of a look up or down the eyes do
as much as the head, and heads are held differently. So its likelihood is broad, has a large tail, and is only used where the
stage states how sure it is; a pitch of large sigma then says as good as nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .config import HandConfig, HeadConfig
from .evidence import HandObservation, HeadObservation
from .localisation import PersonPlace

Values = npt.NDArray[np.float64]
GAIN_STEPS = 8
LEAST_BESIDE_M = 1e-3
# Angles that a head may be pitched to, and an arm raised to, anywhere: the tail is spread over them.
PITCHES_DEG, ELEVATIONS_DEG = 120.0, 120.0


class Heights(NamedTuple):
    """Of points at the person's head: angles above the horizontal (n), and how far apart their parts look (n), degrees."""

    elevations: Values
    across: Values

    @staticmethod
    def of(place: PersonPlace, points_m: Values, extent_m: Values) -> Heights:
        """Of points (n, 3), map frame, with a size across (n), metres, of which any part may be looked at."""
        x, y, z = (points_m - place.position_m).T
        beside = np.hypot(x, y)
        away = np.maximum(np.hypot(beside, z), extent_m / 2 + 1e-3)
        return Heights(
            np.degrees(np.arctan2(z, np.maximum(beside, LEAST_BESIDE_M))),
            np.degrees(np.arctan2(extent_m / math.sqrt(12), away)),
        )


def elevation_of_head(head: HeadObservation, place: PersonPlace) -> float | None:
    """Angle of the head's direction above the horizontal, degrees; none where pitch, its sigma or yaw is not known."""
    if head.yaw_deg is None or head.pitch_deg is None or head.pitch_sigma_deg is None:
        return None
    yaw, pitch, roll = math.radians(head.yaw_deg), math.radians(head.pitch_deg), math.radians(place.camera_roll_deg)
    beside = max(math.dist(place.camera_m[:2], place.position_m[:2]), LEAST_BESIDE_M)
    camera = math.atan2(place.camera_m[2] - place.position_m[2], beside)
    # Of the head's direction: the parts to the camera, to the picture's right and to its top, which a rolled camera turns.
    ahead, right, top = math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch)
    up = ahead * math.sin(camera) + (top * math.cos(roll) - right * math.sin(roll)) * math.cos(camera)
    return math.degrees(math.asin(min(1.0, max(-1.0, up))))


def hand_likelihoods(hand: HandObservation, meant: Heights, config: HandConfig) -> Values | None:
    """P(the hand's elevation | the person means the point), for each beside one where it fits best: 0 to 1 (n).

    None where the elevation is not measured.
    """
    if hand.elevation_deg is None or hand.elevation_sigma_deg is None:
        return None
    sigma = np.hypot(max(hand.elevation_sigma_deg, config.sigma_floor_deg), meant.across)
    off = (meant.elevations - hand.elevation_deg) / sigma
    return _with_tail(np.exp(-0.5 * off * off), sigma, config.elevation_outlier, ELEVATIONS_DEG)


def head_likelihoods(head: HeadObservation, place: PersonPlace, meant: Heights, config: HeadConfig) -> Values | None:
    """P(the head's elevation | the person means the point), for each beside one where it fits best: 0 to 1 (n).

    None where the elevation is not measured.
    """
    seen = elevation_of_head(head, place)
    if seen is None:
        return None
    sigma = np.sqrt((head.pitch_sigma_deg or 0.0) ** 2 + config.pitch_sigma_deg**2 + meant.across**2)
    gains = np.linspace(config.pitch_gain_min, config.pitch_gain_max, GAIN_STEPS)
    off = (np.multiply.outer(gains, meant.elevations) - seen) / sigma
    hit = np.add.reduce(np.exp(-0.5 * off * off)) / GAIN_STEPS
    return _with_tail(hit, sigma, config.pitch_outlier, PITCHES_DEG)


def _with_tail(hit: Values, sigma: Values, outlier: float, spread_deg: float) -> Values:
    """Densities (n) of angles that are nonsense with that probability, of `hit` beside the best that there can be: 0 to 1 (n).

    That best is the density in the middle of a normal distribution of that sigma (n).
    """
    best, tail = (1 - outlier) / math.sqrt(2 * math.pi) / sigma, outlier / spread_deg
    return np.asarray((hit * best + tail) / (best + tail))
