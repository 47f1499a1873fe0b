"""Which POIs are visible in the paper's sense: by the robot and by the person (section 7.2)."""

from __future__ import annotations

import numpy as np

from .localisation import PersonPlace
from .sight import Bearings, Sight
from .visibility import Walls


def seen_by_both(seen: Sight, place: PersonPlace, walls: Walls, clearance_m: float) -> Sight:
    """Of the POIs that the person sees, those that no wall hides from the camera either, in whatever direction it looks.

    `clearance_m`: the last part of a sight line, where walls do not count.
    """
    camera = (place.camera_m[0], place.camera_m[1])
    shown = np.flatnonzero(~walls.hide(camera, seen.points.xy[seen.chosen], clearance_m))
    likeliest, sigma, cases = seen.bearings
    return Sight(Bearings(likeliest[shown], sigma[shown], cases[:, shown]), seen.points, seen.chosen[shown])
