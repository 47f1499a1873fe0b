"""Plain shapes of a room as triangles, in the world frame (metres)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector = Sequence[float] | Floats
"""Three numbers."""

LATHE_SIDES = 36
PLANT_LEAVES = 60


@dataclass(frozen=True)
class Shape:
    """Vertices (n, 3), unit normals (n, 3), texture coordinates (n, 2) with v downward, triangles (m, 3)."""

    vertices: Floats
    normals: Floats
    texture_coordinates: Floats
    triangles: NDArray[np.int32]


def joined(shapes: Sequence[Shape]) -> Shape:
    """Several shapes as one."""
    starts = np.cumsum([0, *(len(shape.vertices) for shape in shapes[:-1])])
    return Shape(
        np.vstack([shape.vertices for shape in shapes]),
        np.vstack([shape.normals for shape in shapes]),
        np.vstack([shape.texture_coordinates for shape in shapes]),
        np.vstack([shape.triangles + start for shape, start in zip(shapes, starts, strict=True)]).astype(np.int32),
    )


def quad(corner: Vector, along: Vector, up: Vector, repeat: tuple[float, float] = (1, 1)) -> Shape:
    """A parallelogram that faces along x up; the texture repeats so many times along its two sides."""
    p, a, b = (np.asarray(v, float) for v in (corner, along, up))
    normal = np.cross(a, b)
    u, v = repeat
    return Shape(
        np.array([p, p + a, p + a + b, p + b]),
        np.tile(normal / np.linalg.norm(normal), (4, 1)),
        np.array([[0, v], [u, v], [u, 0], [0, 0]], float),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )


def box(centre: Vector, size: Vector, turn_deg: float = 0.0) -> Shape:
    """A box, turned about the vertical."""
    a, b, d = (float(s) / 2 for s in size)
    faces = [
        quad((-a, -b, d), (2 * a, 0, 0), (0, 2 * b, 0)),
        quad((a, -b, -d), (-2 * a, 0, 0), (0, 2 * b, 0)),
        quad((a, -b, d), (0, 0, -2 * d), (0, 2 * b, 0)),
        quad((-a, -b, -d), (0, 0, 2 * d), (0, 2 * b, 0)),
        quad((-a, b, d), (2 * a, 0, 0), (0, 0, -2 * d)),
        quad((-a, -b, -d), (2 * a, 0, 0), (0, 0, 2 * d)),
    ]
    return placed(joined(faces), centre, turn_deg)


def lathe(centre: Vector, profile: Sequence[tuple[float, float]]) -> Shape:
    """A solid of revolution about the vertical; the profile is (radius, height) from below to above."""
    outline = np.asarray(profile, float)
    rings, sides = len(outline), LATHE_SIDES + 1
    angle = np.linspace(0, 2 * math.pi, sides)
    around = np.stack([np.cos(angle), np.zeros(sides), np.sin(angle)], 1)
    vertices = outline[:, None, :1] * around + outline[:, None, 1:] * np.array([0.0, 1.0, 0.0])
    tangent = np.gradient(outline, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True) + 1e-12
    normals = tangent[:, None, 1:] * around - tangent[:, None, :1] * np.array([0.0, 1.0, 0.0])
    u, v = np.meshgrid(np.linspace(0, 1, sides), np.linspace(1, 0, rings))
    first = (np.arange(rings - 1)[:, None] * sides + np.arange(sides - 1)).ravel()
    lower = np.stack([first, first + 1, first + sides + 1], 1)
    upper = np.stack([first, first + sides + 1, first + sides], 1)
    flat = normals.reshape(-1, 3)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    return Shape(
        vertices.reshape(-1, 3) + np.asarray(centre, float),
        flat,
        np.stack([u, v], -1).reshape(-1, 2),
        np.vstack([lower, upper]).astype(np.int32),
    )


def sphere(centre: Vector, radius: float) -> Shape:
    """A ball."""
    angle = np.linspace(-math.pi / 2, math.pi / 2, 20)
    profile = [(max(radius * math.cos(a), 1e-4), radius * math.sin(a)) for a in angle]
    return lathe(centre, profile)


def plant(foot: Vector, height: float, rng: np.random.Generator) -> Shape:
    """Leaves that arch out of a pot."""
    leaves = [_leaf(height, rng) for _ in range(PLANT_LEAVES)]
    return placed(joined(leaves), foot)


def _leaf(height: float, rng: np.random.Generator) -> Shape:
    azimuth, length, bend = rng.uniform(0, 2 * math.pi), rng.uniform(0.3, 0.75) * height, rng.uniform(0.25, 0.9)
    t = np.linspace(0, 1, 7)
    outward = np.array([math.cos(azimuth), 0.0, math.sin(azimuth)])
    across = np.array([-math.sin(azimuth), 0.0, math.cos(azimuth)])
    rise = length * (1.1 * t - 0.7 * bend * t**2)
    middle = outward * (t * length * bend)[:, None] + np.array([0.0, 1.0, 0.0]) * rise[:, None]
    half = rng.uniform(0.03, 0.06) * np.sin(math.pi * (0.85 * t + 0.1))[:, None]
    normal = np.cross(across, np.gradient(middle, axis=0))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.where(normal[:, 1:2] < 0, -1.0, 1.0)
    first = np.arange(6)
    triangles = np.vstack([np.stack([first, first + 1, first + 8], 1), np.stack([first, first + 8, first + 7], 1)])
    coordinates = np.stack([np.repeat([0.0, 1.0], 7), np.tile(t, 2)], 1)
    return Shape(
        np.vstack([middle + across * half, middle - across * half]),
        np.vstack([normal, normal]),
        coordinates,
        triangles.astype(np.int32),
    )


def placed(shape: Shape, centre: Vector, turn_deg: float = 0.0) -> Shape:
    """The shape turned about the vertical through its origin, then moved."""
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return Shape(
        shape.vertices @ turn.T + np.asarray(centre, float),
        shape.normals @ turn.T,
        shape.texture_coordinates,
        shape.triangles,
    )
