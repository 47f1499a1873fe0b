"""The head as a sphere that a camera sees from near: vertical perspective projection (eqs 5-9 of Pateraki et al. 2011).

Longitudes are angles about the head's vertical axis from the line head -> camera, radians, positive toward image right. P is
the distance of the camera from the head's centre in head radii. x is an offset in the picture from the head's centre, in radii
on the plane that touches the sphere where it is nearest to the camera, P - 1 away. With phi = phi_1 = lambda_0 = 0, eq. 7 reads
cos c = cos(lambda). The same holds for latitudes, with y.
"""

from __future__ import annotations

import numpy as np

from .head import Array


def projected(longitude: Array, distance: float) -> Array:
    """Eqs 5 and 6: the offset x = k' sin(lambda) at which a longitude is seen, k' = (P - 1) / (P - cos(lambda))."""
    return np.asarray((distance - 1) / (distance - np.cos(longitude)) * np.sin(longitude))


def longitude_of(x: Array, distance: float) -> Array:
    """Eq. 8: the longitude that is seen at an offset x.

    As printed, lambda = arcsin(x / k') is circular, for k' depends on lambda. The line of sight meets the sphere at
    lambda = arcsin(x P / R) - arctan(x / (P - 1)), R = sqrt((P - 1)^2 + x^2), which is the same solved for lambda. An x outside
    the sphere's outline gives the horizon, arccos(1 / P).
    """
    outline = np.arcsin(1 / distance)
    ray = np.clip(np.arctan2(x, distance - 1), -outline, outline)
    return np.asarray(np.arcsin(np.clip(distance * np.sin(ray), -1, 1)) - ray)


def angle_of_edges(x: Array, distance: float) -> float:
    """Eq. 9: the angle lambda_h of a patch, the mean of the longitudes of its two edges (2,), radians."""
    return float(longitude_of(x, distance).mean())
