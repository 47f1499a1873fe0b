"""World points as pixels and boxes, in the numbers that labels hold."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .geometry import Floats, View

NEAREST_M = 0.1
"""What is nearer to the camera's plane, or behind it, is projected as if it were there: pixels stay finite."""


def pixel(point: Floats, view: View, digits: int = 1) -> list[float]:
    """Pixel of a world point."""
    x, y, z = view.in_camera(point)
    seen = view.matrix @ np.array([x, y, max(z, NEAREST_M)])
    return rounded(seen[:2] / seen[2], digits)


def box_around(points: Floats, view: View) -> list[float] | None:
    """x, y, width, height around world points (n, 3), also beyond the picture; none where all are behind the camera."""
    ahead = points[view.in_camera(points)[:, 2] > NEAREST_M]
    if not len(ahead):
        return None
    pixels = view.project(ahead)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    return rounded([*low, *(high - low)], 1)


def rounded(values: Iterable[float], digits: int) -> list[float]:
    """Plain numbers for JSON."""
    return [round(float(value), digits) for value in values]
