"""Rotations of bones: matrices (3, 3) that turn column vectors. Degrees."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from .geometry import Floats

Vector = Floats | Sequence[float]
RIGHT: Floats = np.array([1.0, 0.0, 0.0])
UP: Floats = np.array([0.0, 1.0, 0.0])
AHEAD: Floats = np.array([0.0, 0.0, 1.0])
_TINY = 1e-9


def unit(vector: Vector) -> Floats:
    """The vector with length 1; a null vector stays null."""
    array = np.asarray(vector, float)
    return array / max(math.sqrt(float(array @ array)), _TINY)


def cross(a: Floats, b: Floats) -> Floats:
    """The cross product of two vectors (3,); several times faster than numpy's."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def across(vector: Vector, axis: Floats) -> Floats:
    """The part of `vector` that is perpendicular to the unit vector `axis`, with length 1."""
    array = np.asarray(vector, float)
    return unit(array - axis * (array @ axis))


def about(axis: Vector, angle_deg: float) -> Floats:
    """A turn about an axis, counter-clockwise seen from its tip (Rodrigues)."""
    x, y, z = unit(axis)
    sine, cosine = math.sin(math.radians(angle_deg)), math.cos(math.radians(angle_deg))
    rest = 1 - cosine
    return np.array(
        [
            [cosine + x * x * rest, x * y * rest - z * sine, x * z * rest + y * sine],
            [y * x * rest + z * sine, cosine + y * y * rest, y * z * rest - x * sine],
            [z * x * rest - y * sine, z * y * rest + x * sine, cosine + z * z * rest],
        ]
    )


def turn(yaw_deg: float, pitch_down_deg: float = 0.0, roll_deg: float = 0.0) -> Floats:
    """Yaw from +Z toward +X, then pitch that lowers +Z, then roll about +Z."""
    return about(UP, yaw_deg) @ about(RIGHT, pitch_down_deg) @ about(AHEAD, roll_deg)


def swing(start: Vector, end: Vector) -> Floats:
    """The shortest turn that brings one direction into the other."""
    a, b = unit(start), unit(end)
    axis = cross(a, b)
    sine, cosine = math.sqrt(float(axis @ axis)), float(a @ b)
    if sine > _TINY:
        return about(axis, math.degrees(math.atan2(sine, cosine)))
    if cosine > 0:
        return np.eye(3)
    return about(across(UP if abs(a[1]) < 0.9 else RIGHT, a), 180.0)


def frame(along: Vector, toward: Vector) -> Floats:
    """Axes (columns) whose second is `along` and whose third is as near `toward` as can be."""
    second = unit(along)
    third = across(toward, second)
    return np.stack([cross(second, third), second, third], axis=1)


def angle_about(axis: Floats, start: Floats, end: Floats) -> float:
    """Angle about a unit axis from one direction to another, both perpendicular to it."""
    return math.degrees(math.atan2(float(cross(start, end) @ axis), float(start @ end)))


def between(start: Floats, end: Floats, share: float) -> Floats:
    """The turn at `share` of the shortest way from one to the other."""
    if share <= 0:
        return start
    if share >= 1:
        return end
    way = Rotation.from_matrix(start.T @ end).as_rotvec()
    return start @ about(way, math.degrees(float(np.linalg.norm(way))) * share)


def azimuth_deg(direction: Vector) -> float:
    """Of a direction about Y, from +Z toward +X."""
    return math.degrees(math.atan2(direction[0], direction[2]))


def elevation_deg(direction: Vector) -> float:
    """Of a direction above the floor."""
    return math.degrees(math.atan2(direction[1], math.hypot(direction[0], direction[2])))


def heading_vector(azimuth: float, elevation: float = 0.0) -> Floats:
    """The direction of an azimuth and an elevation, degrees."""
    a, e = math.radians(azimuth), math.radians(elevation)
    return np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
