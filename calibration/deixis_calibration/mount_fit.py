"""How the camera is mounted, by least squares: from people who stood at known spots and pointed at known POIs.

Unknown together: yaw and tilt of the mount, the height of the person's head, which part of the way heads turn, and where people
really stood. What speaks: where the head is in the picture and how far away, the hand's bearing and the head's yaw.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
from deixis_fusion.localisation import wrapped_deg
from deixis_runtime.mount import to_base
from deixis_schemas.messages import CameraMount, Poi
from numpy.typing import NDArray

# SciPy: least squares with covariance by its Jacobian; BSD, well kept.
from scipy.optimize import least_squares

from .pointings import Pointing

Spot = tuple[float, float]
STANDING_M = 0.03
"""Feet on a mark; the head sways about them."""
SIGHT_DEG, DISTANCE_SHARE = 1.0, 0.1
LEAST_HAND_DEG, LEAST_HEAD_DEG = 8.0, 8.0
"""What people's arms and heads are off at least, beyond what their stages state."""
GAIN, GAIN_SIGMA = 0.85, 0.15
USUAL_HEAD_M, UNKNOWN_HEAD_M, KNOWN_HEAD_M = 1.6, 0.12, 0.03
HEAD_BELOW_CROWN_M = 0.13
FARTHEST_DEG = 20.0
"""The mount in the site file is right to this: it was measured with a protractor, not guessed."""
FARTHEST_YAW_DEG = 110.0
FEWEST = 4


class MountFitError(ValueError):
    """Pointings that no mount can be told from; the text says why."""


@dataclass(frozen=True)
class MountFit:
    """The mount as corrected, degrees; sigmas are standard errors. distance_ratio: measured over true distance (median).

    hand_off_deg: median error of the hand's bearing, with the mount as it was and as corrected; none without bearings.
    """

    mount: CameraMount
    yaw_change_deg: float
    pitch_change_deg: float
    yaw_sigma_deg: float
    pitch_sigma_deg: float
    head_height_m: float
    head_gain: float
    distance_ratio: float
    hand_off_deg: tuple[float, float] | None

    @property
    def is_needed(self) -> bool:
        """Whether the change is more than its error may be."""
        return abs(self.yaw_change_deg) > 2 * self.yaw_sigma_deg or abs(self.pitch_change_deg) > 2 * self.pitch_sigma_deg


def fit_mount(
    pointings: Sequence[Pointing],
    pois: Mapping[str, Poi],
    spots: Mapping[str, Spot],
    mount: CameraMount,
    person_height_m: float | None = None,
) -> MountFit:
    """The mount that explains best what was measured; spots in the map, metres. Raises MountFitError."""
    known = [pointing for pointing in pointings if pointing.spot in spots and pointing.poi_id in pois]
    if len(known) < FEWEST:
        raise MountFitError(
            f"{len(known)} pointings at known POIs from known spots: {FEWEST} are the fewest, 20 and more are good"
        )
    problem = _Problem(known, pois, spots, mount, person_height_m)
    found = least_squares(problem.residuals, problem.start, x_scale=problem.scale)
    if not found.success:
        raise MountFitError("no mount fits these pointings: are spots and POIs in the map where people stood and pointed?")
    spread = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)))
    yaw, pitch, height, gain = (float(value) for value in found.x[:4])
    corrected = mount.model_copy(update={"yaw_deg": mount.yaw_deg + yaw, "pitch_up_deg": mount.pitch_up_deg + pitch})
    offs = [(problem.hand_off(one, problem.start), problem.hand_off(one, found.x)) for one in known]
    hand = [(abs(before), abs(after)) for before, after in offs if before is not None and after is not None]
    return MountFit(
        corrected,
        yaw,
        pitch,
        float(spread[0]),
        float(spread[1]),
        height,
        gain,
        median(problem.distance_ratio(one, found.x) for one in known),
        (median(before for before, _ in hand), median(after for _, after in hand)) if hand else None,
    )


class _Problem:
    """Unknowns: changes of yaw and pitch (degrees), height of the head (m), gain of the head, and x, y of each spot (m)."""

    def __init__(
        self,
        pointings: Sequence[Pointing],
        pois: Mapping[str, Poi],
        spots: Mapping[str, Spot],
        mount: CameraMount,
        person_height_m: float | None,
    ) -> None:
        self._pointings, self._pois, self._mount = pointings, pois, mount
        self._names = sorted({pointing.spot for pointing in pointings})
        self._marks = np.array([spots[name] for name in self._names])
        self._height = USUAL_HEAD_M if person_height_m is None else person_height_m - HEAD_BELOW_CROWN_M
        self._height_sigma = UNKNOWN_HEAD_M if person_height_m is None else KNOWN_HEAD_M
        self.start = np.array([0.0, 0.0, self._height, GAIN, *self._marks.ravel()])
        self.scale = np.array([1.0, 1.0, 0.1, 0.1, *[0.05] * self._marks.size])

    def residuals(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """In standard deviations."""
        marks = (x[4:].reshape(-1, 2) - self._marks) / STANDING_M
        priors = [x[0] / FARTHEST_DEG, x[1] / FARTHEST_DEG]
        priors += [(x[2] - self._height) / self._height_sigma, (x[3] - GAIN) / GAIN_SIGMA]
        parts = [value for pointing in self._pointings for value in self._of(pointing, x)]
        return np.array([*priors, *marks.ravel(), *parts])

    def hand_off(self, pointing: Pointing, x: NDArray[np.float64]) -> float | None:
        """How far the hand's bearing is off, degrees."""
        if pointing.bearing_deg is None:
            return None
        expected = self._expected(pointing, x)
        off = wrapped_deg(pointing.bearing_deg - expected)
        behind = wrapped_deg(180 - pointing.bearing_deg - expected)
        return behind if pointing.mirrored and abs(behind) < abs(off) else off

    def distance_ratio(self, pointing: Pointing, x: NDArray[np.float64]) -> float:
        """Measured over true distance, along the floor."""
        seen = self._seen(pointing, x)
        return math.hypot(seen[0], seen[1]) / math.dist(self._spot(pointing, x), self._camera(pointing)[:2])

    def _of(self, pointing: Pointing, x: NDArray[np.float64]) -> list[float]:
        spot, camera, seen = self._spot(pointing, x), self._camera(pointing), self._seen(pointing, x)
        away = math.dist(spot, camera[:2])
        azimuth = math.degrees(math.atan2(spot[1] - camera[1], spot[0] - camera[0]))
        flat = math.hypot(seen[0], seen[1])
        height = math.degrees(math.atan2(float(x[2]) - camera[2], away))
        hand = self.hand_off(pointing, x)
        return [
            wrapped_deg(math.degrees(math.atan2(seen[1], seen[0])) - azimuth) / SIGHT_DEG,
            (math.degrees(math.atan2(seen[2], flat)) - height) / SIGHT_DEG,
            math.log(flat / away) / DISTANCE_SHARE,
            0.0 if hand is None else _bounded(hand / math.hypot(LEAST_HAND_DEG, pointing.bearing_sigma_deg or 0.0)),
            self._head_off(pointing, x),
        ]

    def _head_off(self, pointing: Pointing, x: NDArray[np.float64]) -> float:
        expected = self._expected(pointing, x)
        if pointing.yaw_deg is None or abs(expected) > FARTHEST_YAW_DEG:
            return 0.0
        off = wrapped_deg(pointing.yaw_deg - float(x[3]) * expected)
        return _bounded(off / math.hypot(LEAST_HEAD_DEG, pointing.yaw_sigma_deg or 0.0))

    def _expected(self, pointing: Pointing, x: NDArray[np.float64]) -> float:
        """Bearing of the POI at the person, who stands there: from the direction to the camera."""
        spot, camera = self._spot(pointing, x), self._camera(pointing)
        poi = self._pois[pointing.poi_id].position_m
        to_poi = math.degrees(math.atan2(poi[1] - spot[1], poi[0] - spot[0]))
        return wrapped_deg(to_poi - math.degrees(math.atan2(camera[1] - spot[1], camera[0] - spot[0])))

    def _seen(self, pointing: Pointing, x: NDArray[np.float64]) -> tuple[float, float, float]:
        """The head as the camera sees it, in directions of the map, metres from the camera."""
        yaw, pitch = self._mount.yaw_deg + float(x[0]), self._mount.pitch_up_deg + float(x[1])
        turned = CameraMount.model_construct(yaw_deg=yaw, pitch_up_deg=pitch, roll_deg=self._mount.roll_deg)
        ahead, left, up = to_base(pointing.head_m, turned)
        cos, sin = math.cos(math.radians(pointing.robot.yaw_deg)), math.sin(math.radians(pointing.robot.yaw_deg))
        return ahead * cos - left * sin, ahead * sin + left * cos, up

    def _spot(self, pointing: Pointing, x: NDArray[np.float64]) -> Spot:
        at = 4 + 2 * self._names.index(pointing.spot)
        return float(x[at]), float(x[at + 1])

    def _camera(self, pointing: Pointing) -> tuple[float, float, float]:
        ahead, left, up = self._mount.position_m
        robot = pointing.robot
        cos, sin = math.cos(math.radians(robot.yaw_deg)), math.sin(math.radians(robot.yaw_deg))
        return robot.x_m + ahead * cos - left * sin, robot.y_m + ahead * sin + left * cos, up


def _bounded(off: float) -> float:
    """Beyond two sigma an error counts ever less (pseudo-Huber): some arms and heads point elsewhere."""
    return math.copysign(math.sqrt(8 * (math.sqrt(1 + off * off / 4) - 1)), off)
