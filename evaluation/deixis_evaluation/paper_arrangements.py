"""Arrangements of robot and person in a room, drawn at random, and which POIs both see (section 7.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .paper_rooms import Room

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]
Limits = tuple[float, float]

OFF_WALL_M = 0.5
"""Nearer to a wall nobody stands, nor does a robot."""
NEAREST_M = 1.0
FARTHEST_M = 2.5
"""Robot and person stand so far from each other. Chosen by table 3, `fitting/choose_paper.py`."""
CLEARANCE_M = 0.15
"""A POI this far behind a wall's face hangs on it; as fusion's `place.wall_clearance_m`."""
ROUNDING = 1e-9
OVERSHOOT = 4
"""So many pairs of places are drawn for each arrangement that is missing."""


@dataclass(frozen=True, eq=False)
class Arrangements:
    """t arrangements with n POIs: places of `robot` and `person` (t, 2), metres; `bearing_deg` (t, n) at the person from the
    direction of the robot, counter-clockwise; `visible` (t, n) to both; `meant` (t), the POI pointed to.
    """

    robot: Values
    person: Values
    bearing_deg: Values
    visible: Flags
    meant: Indices

    def __len__(self) -> int:
        return len(self.meant)

    @property
    def meant_deg(self) -> Values:
        """Bearing of the POI meant (t)."""
        return self.bearing_deg[np.arange(len(self)), self.meant]

    def part(self, rows: slice) -> Arrangements:
        """Some of them."""
        return Arrangements(self.robot[rows], self.person[rows], self.bearing_deg[rows], self.visible[rows], self.meant[rows])


class _Pairs(NamedTuple):
    robot: Values
    person: Values


def draw(room: Room, count: int, rng: np.random.Generator, limits_m: Limits = (NEAREST_M, FARTHEST_M)) -> Arrangements:
    """So many arrangements: places even over the floor, where robot and person see each other and both see a POI.

    `limits_m` is how near and how far robot and person stand from each other.
    """
    found: list[Arrangements] = []
    missing = count
    while missing:
        candidates = _seen(room, _pairs(room, OVERSHOOT * missing + 64, limits_m, rng), rng)
        found.append(candidates.part(slice(missing)))
        missing -= len(found[-1])
    return _joined(found)


def hidden(eyes: Values, targets: Values, walls: Values, clearance_m: float) -> Flags:
    """Whether a wall (w, 2, 2) crosses the way from an eye (..., 2) to its target, the last `clearance_m` of it left out.

    What `deixis_fusion.visibility.Walls` says of one eye, for an eye a target.
    """
    start, way = eyes[..., 0] + 1j * eyes[..., 1], (targets - eyes) @ np.array([1, 1j])
    length = np.abs(way)
    share = np.maximum(length - clearance_m, 0) / np.maximum(length, ROUNDING)
    blocked = np.zeros(start.shape, dtype=np.bool_)
    for one, other in walls @ np.array([1, 1j]):
        along = other - one
        slant = _cross(way, along)
        safe = np.where(np.abs(slant) < ROUNDING, 1.0, slant)
        at, on = _cross(one - start, along) / safe, _cross(one - start, way) / safe
        crosses = (at >= -ROUNDING) & (at <= share + ROUNDING) & (on >= -ROUNDING) & (on <= 1 + ROUNDING)
        blocked |= crosses & (np.abs(slant) >= ROUNDING)
    return blocked


def _pairs(room: Room, count: int, limits_m: Limits, rng: np.random.Generator) -> _Pairs:
    pairs, (nearest_m, farthest_m) = _Pairs(_places(room, count, rng), _places(room, count, rng)), limits_m
    distance = np.linalg.norm(pairs.robot - pairs.person, axis=1)
    apart = (distance >= nearest_m) & (distance <= farthest_m)
    return _Pairs(pairs.robot[apart], pairs.person[apart])


def _places(room: Room, count: int, rng: np.random.Generator) -> Values:
    """Places even over the floor, off the walls."""
    boxes = np.array(room.boxes)
    low, size = boxes[:, :2] + OFF_WALL_M, boxes[:, 2:] - boxes[:, :2] - 2 * OFF_WALL_M
    areas = size.prod(axis=1)
    chosen = rng.choice(len(boxes), size=count, p=areas / areas.sum())
    return np.asarray(low[chosen] + rng.random((count, 2)) * size[chosen])


def _seen(room: Room, pairs: _Pairs, rng: np.random.Generator) -> Arrangements:
    walls, pois = room.wall_ends, room.poi_positions
    facing = ~hidden(pairs.robot, pairs.person, walls, 0.0)
    robot, person = pairs.robot[facing], pairs.person[facing]
    targets = np.broadcast_to(pois, (len(robot), *pois.shape))
    visible = np.ones((len(robot), len(pois)), dtype=np.bool_)
    for eyes in (robot, person):
        visible &= ~hidden(np.broadcast_to(eyes[:, None], targets.shape), targets, walls, CLEARANCE_M)
    some = visible.any(axis=1)
    robot, person, visible = robot[some], person[some], visible[some]
    to_robot = (robot - person) @ np.array([1, 1j])
    to_pois = (pois - person[:, None]) @ np.array([1, 1j])
    bearings = np.degrees(np.angle(to_pois * to_robot.conj()[:, None]))
    meant = np.argmax(np.where(visible, rng.random(visible.shape), -1.0), axis=1)
    return Arrangements(robot, person, bearings, visible, meant)


def _joined(parts: list[Arrangements]) -> Arrangements:
    return Arrangements(
        np.concatenate([part.robot for part in parts]),
        np.concatenate([part.person for part in parts]),
        np.concatenate([part.bearing_deg for part in parts]),
        np.concatenate([part.visible for part in parts]),
        np.concatenate([part.meant for part in parts]),
    )


def _cross(a: npt.NDArray[np.complex128], b: npt.NDArray[np.complex128]) -> Values:
    return np.asarray((np.conj(a) * b).imag, dtype=np.float64)
