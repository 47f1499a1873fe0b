"""From where portraits are taken: how high above or below the head, and so that a raised hand comes before the face."""

from __future__ import annotations

import numpy as np

from .geometry import Floats

HAND_SPREAD_DEG = 12.0
"""How cameras spread about the bearing of a hand that shall be at the face."""
USUAL_ELEVATION_DEG = (-3.0, 11.0)
"""Of cameras above the head: mean, deviation."""
ODD_HEIGHTS, ELEVATIONS_DEG = 0.4, (-40.0, 40.0)
"""Share of cameras from any elevation, and what elevations there are. Without them next to no portrait was from so far
below as a robot's camera near a person sees a face from: services/headpose/README.md, clip s1005."""


def camera_bearing(rng: np.random.Generator, bearing_deg: Floats) -> Floats:
    """Azimuth and elevation (2,) of a camera, degrees, that has the hand before the face or near it."""
    return bearing_deg + rng.normal(0, HAND_SPREAD_DEG, 2)


def camera_elevation_deg(rng: np.random.Generator) -> float:
    """How far a camera is above a head: a robot's is lower than grown people's, and looks up the more the nearer they come."""
    if rng.random() < ODD_HEIGHTS:
        return float(rng.uniform(*ELEVATIONS_DEG))
    return float(np.clip(rng.normal(*USUAL_ELEVATION_DEG), *ELEVATIONS_DEG))
