"""How high a true pointing goes: angle of its POI above the horizontal, at the person's head."""

from __future__ import annotations

from statistics import median

import numpy as np

from .clips import Truth
from .episode_scores import Stroke

UP = 1
"""Axis of the world of the labels that points up."""


def elevation_of(stroke: Stroke, truth: Truth) -> float | None:
    """Degrees, over the stroke; none where the labels do not place the head or the POI."""
    poi = next((np.array(poi.xyz_world) for poi in truth.meta.pois if poi.id == stroke.poi), None)
    if poi is None:
        return None
    angles = []
    for frame, person in zip(truth.frames[stroke.first : stroke.last + 1], stroke.persons, strict=True):
        if person.head.center_cam is None:
            continue
        camera = frame.camera or truth.meta.camera
        to_poi = poi - (camera.rotation.T @ np.array(person.head.center_cam) + camera.centre)
        rise = float(to_poi[UP])
        angles.append(float(np.degrees(np.arctan2(rise, np.linalg.norm(np.delete(to_poi, UP))))))
    return median(angles) if angles else None
