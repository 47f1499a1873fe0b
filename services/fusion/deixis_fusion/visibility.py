"""Which POIs a person can see past the walls, which are segments in the plane (the paper's rooms, section 7.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import Poi

Point2 = tuple[float, float]
Wall = tuple[Point2, Point2]
Values = npt.NDArray[np.float64]

# Of angles, radians: so that a line of sight through the end of a wall, or the corner of two, is not open by rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Candidate:
    """A POI that the person may mean. The bearing is at the person, positive toward the person's own left; degrees."""

    poi: Poi
    bearing_deg: float
    bearing_sigma_deg: float


class Walls:
    """Walls as arrays, to look past all of them at once.

    Around an eye every wall takes up an interval of directions, and hides nothing outside it. Of points sorted by direction
    those within are a slice: 1000 points and 200 walls leave some thousand pairs to compare, not 200 000.
    """

    def __init__(self, walls: Sequence[Wall]) -> None:
        ends = np.array(walls, dtype=np.float64).reshape(-1, 2, 2)
        self._from, self._to = ends[:, 0] @ np.array([1, 1j]), ends[:, 1] @ np.array([1, 1j])

    def __len__(self) -> int:
        return len(self._from)

    def hide(self, eye: Point2, points: Values, clearance_m: float, reach_m: Values | None = None) -> npt.NDArray[np.bool_]:
        """Which of the points (n, 2), map frame, a wall hides from the eye.

        POIs hang on walls, on either side of the line that stands for one: the last `clearance_m` of the way do not count. Nor
        does a line that lies within `reach_m` (n) of the point: in a map of what is occupied an exhibit is a wall itself.
        """
        hidden = np.zeros(len(points), dtype=np.bool_)
        if not len(self._from) or not len(points):
            return hidden
        ways = points[:, 0] - eye[0] + 1j * (points[:, 1] - eye[1])
        first, second = self._from - complex(*eye), self._to - complex(*eye)
        angles = np.angle(ways)
        order = np.argsort(angles)
        wall, rank = _pairs(first, second, angles[order])
        point = order[rank]
        reach = np.abs(ways[point]) - clearance_m
        blocked = (reach > 0) & (_distance_to(first[wall], second[wall], ways[point]) <= reach + ROUNDING)
        wall, point = wall[blocked], point[blocked]
        if reach_m is not None:
            farther = np.maximum(np.abs(first[wall] - ways[point]), np.abs(second[wall] - ways[point]))
            point = point[farther > reach_m[point]]
        hidden[point] = True
        return hidden


def sees(eye: Point2, target: Point2, walls: Sequence[Wall], clearance_m: float = 0.15) -> bool:
    """Whether the line of sight from `eye` to `target` crosses no wall but within its last `clearance_m`; map frame, metres."""
    return not Walls(walls).hide(eye, np.array([target]), clearance_m)[0]


def _pairs(
    first: npt.NDArray[np.complex128], second: npt.NDArray[np.complex128], angles: Values
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Each wall (its ends as seen from the eye) with each of the ascending angles that lies within its interval."""
    one, turn = np.angle(first), np.angle(second * first.conj())
    low = np.where(turn < 0, one + turn, one) - ROUNDING
    width = np.abs(turn) + 2 * ROUNDING
    # An eye on the wall itself, or at its end, has it in any direction.
    touching = (np.minimum(np.abs(first), np.abs(second)) < ROUNDING) | (np.abs(turn) > math.pi - ROUNDING)
    low, width = np.where(touching, -math.pi, low), np.where(touching, 2 * math.pi + ROUNDING, width)
    twice = np.concatenate([angles - 2 * math.pi, angles, angles + 2 * math.pi])
    start = np.searchsorted(twice, low, "left")
    count = np.minimum(np.searchsorted(twice, low + width, "right") - start, len(angles))
    wall = np.repeat(np.arange(len(low)), count)
    offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return wall, (np.repeat(start, count) + offset) % len(angles)


def _distance_to(
    first: npt.NDArray[np.complex128], second: npt.NDArray[np.complex128], ways: npt.NDArray[np.complex128]
) -> Values:
    """How far the wall is from the eye in the direction of `ways`, metres; where it lies along that, its nearer end."""
    along = second - first
    direction = ways / np.maximum(np.abs(ways), ROUNDING)
    slant = _cross(direction, along)
    parallel = np.abs(slant) < ROUNDING * np.maximum(np.abs(along), ROUNDING)
    nearer = np.minimum(np.abs(first), np.abs(second))
    return np.where(parallel, nearer, np.maximum(0.0, _cross(first, along) / np.where(parallel, 1.0, slant)))


def _cross(a: npt.NDArray[np.complex128], b: npt.NDArray[np.complex128]) -> Values:
    return np.asarray((a.conj() * b).imag, dtype=np.float64)
