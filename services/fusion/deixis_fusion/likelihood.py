"""How likely each POI makes what was seen: P(observed | the person means the POI), before any of it becomes a mass.

Only ratios count: a density in degrees for measured angles, a probability where there is none. Every likelihood has a tail, for
each source is nonsense now and then; so none is 0, and a contradiction is a small number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from deixis_schemas.messages import BEARING_STEP_DEG, Side

from .config import HandConfig, HeadConfig
from .evidence import HandObservation, HeadObservation, PointingGesture
from .localisation import wrapped_deg
from .paper_rules import TABLE_1, normal
from .visibility import Candidate

FULL_CIRCLE_DEG = 360.0
GAIN_STEPS = 8
LOOK_AT_ROBOT_SIGMA_DEG = 8.0
# A side is told wrongly now and then; a zero would make that a total conflict.
WRONG_SIDE = 0.02
# Sine of the bearing within which, ahead and behind, left goes over into right.
SIDE_BORDER = 0.1
LEAST_OUT_OF_RANGE = 0.05
FIT_STEP_DEG = 10

Likelihoods = Sequence[float]


def contour_conflict(first: Likelihoods, second: Likelihoods) -> float:
    """1 - max_i (L1_i / max L1) (L2_i / max L2): 0 where one POI is the likeliest of both, at any number of POIs.

    The conflict of Dempster's rule says little: .5 with 20 POIs in perfect agreement, .85 in contradiction.
    """
    most = max(first) * max(second)
    return 1 - max(a * b for a, b in zip(first, second, strict=True)) / most if most > 0 else 1.0


def fit(likelihood: Callable[[Sequence[Candidate]], Likelihoods], candidate: Candidate) -> float:
    """How well a POI explains what was seen, beside one that hung where it explains it best, 0 to 1."""
    around = [replace(candidate, bearing_deg=float(bearing)) for bearing in range(-180, 180, FIT_STEP_DEG)]
    own, *others = likelihood([candidate, *around])
    return own / max(own, *others)


# --- the hand ---------------------------------------------------------------------------------------------------------


def hand_likelihoods(hand: HandObservation, seen: Sequence[Candidate], config: HandConfig) -> Likelihoods:
    """P(gesture | bearing) P(hand's bearing | bearing) of each POI."""
    gestures = [_gesture_likelihood(hand.gesture, candidate.bearing_deg, config) for candidate in seen]
    if hand.likelihood:
        curve = _curve_likelihoods(hand.likelihood, seen, config)
        return [gesture * value for gesture, value in zip(gestures, curve, strict=True)]
    measured = [bearing for bearing in (hand.bearing_deg, hand.mirror_deg) if bearing is not None]
    if not measured:
        return gestures
    sigma = max(hand.bearing_sigma_deg or 0.0, config.sigma_floor_deg)
    bearings = (_bearing_likelihood(measured, sigma, candidate, config.outlier) for candidate in seen)
    return [gesture * bearing for gesture, bearing in zip(gestures, bearings, strict=True)]


def _gesture_likelihood(gesture: PointingGesture, bearing_deg: float, config: HandConfig) -> float:
    """P(gesture | bearing): table 1's columns, blended over the borders of the hand's range instead of cut there."""
    size = abs(bearing_deg)
    soft = config.soft_deg
    inside = rise(size - config.min_deg, soft) * rise(config.max_deg - size, soft)
    row, miss = TABLE_1[gesture], config.miss
    left = rise(math.sin(math.radians(bearing_deg)), SIDE_BORDER)
    # Table 1 is of fingers seen well; how often one is missed within its range depends on the camera.
    beside = {"point_left": (1 - miss) * left, "point_right": (1 - miss) * (1 - left), "invisible": miss}[gesture]
    # In the centre table 1 gives both sides .05 on average: more to a POI that lies a little to the side of the gesture.
    agrees = {"point_left": 2 * left, "point_right": 2 * (1 - left), "invisible": 1.0}[gesture]
    return max(WRONG_SIDE, inside * beside + (1 - inside) * row["center"] * agrees)


def _bearing_likelihood(measured: Sequence[float], sigma: float, candidate: Candidate, outlier: float) -> float:
    """P(bearing measured at the hand | POI), per degree, with a uniform tail; two bearings where it is mirrored."""
    spread = math.hypot(sigma, candidate.bearing_sigma_deg)
    hit = sum(normal(wrapped_deg(value - candidate.bearing_deg), spread) for value in measured) / len(measured)
    return (1 - outlier) * hit + outlier / FULL_CIRCLE_DEG


def _curve_likelihoods(curve: Sequence[float], seen: Sequence[Candidate], config: HandConfig) -> Likelihoods:
    """P(hand | POI), per degree, by the stage's own likelihood of bearings, blurred by how surely the POI's is known."""
    told = np.array(curve)
    density = told / (told.sum() * BEARING_STEP_DEG)
    bearings = np.array([candidate.bearing_deg for candidate in seen])
    sigma = np.array([max(candidate.bearing_sigma_deg, config.sigma_floor_deg) for candidate in seen])
    off = (bearings[:, None] - np.arange(-180.0, 180.0, BEARING_STEP_DEG) + 180) % 360 - 180
    weights = np.exp(-0.5 * (off / sigma[:, None]) ** 2)
    hit = (weights @ density) / weights.sum(axis=1)
    return [float(value) for value in (1 - config.outlier) * hit + config.outlier / FULL_CIRCLE_DEG]


# --- the head ---------------------------------------------------------------------------------------------------------


def head_likelihoods(head: HeadObservation, seen: Sequence[Candidate], config: HeadConfig) -> Likelihoods:
    """P(yaw | POI) of each POI, per degree; of a head beyond its range, how well it lies out there."""
    if head.yaw_deg is None:
        return [max(LEAST_OUT_OF_RANGE, value) for value in out_of_range_likelihoods(head, seen, config)]
    told, nothing = 1 - config.outlier - config.at_robot, head_tells_nothing(head, config)
    return [told * value + nothing for value in yaw_likelihoods(head, seen, config)]


def head_tells_nothing(head: HeadObservation, config: HeadConfig) -> float:
    """P(yaw and a head that does not look at the POI), per degree: a look at the robot, or nonsense."""
    at_robot = normal(head.yaw_deg or 0.0, math.hypot(head.yaw_sigma_deg or 0.0, LOOK_AT_ROBOT_SIGMA_DEG))
    return config.at_robot * at_robot + config.outlier / FULL_CIRCLE_DEG


def yaw_likelihoods(head: HeadObservation, seen: Sequence[Candidate], config: HeadConfig) -> Likelihoods:
    """P(yaw | the head looks at the POI), per degree: a mixture over the part of the way that people turn the head.

    The part `full_turn` of them turns all the way, the others any of the gains.
    """
    yaw_deg, yaw_sigma_deg, gains = head.yaw_deg or 0.0, head.yaw_sigma_deg or 0.0, _gains(config)

    def at(expected: float, gain: float, candidate: Candidate) -> float:
        sigma = math.sqrt(yaw_sigma_deg**2 + config.sigma_deg**2 + (gain * candidate.bearing_sigma_deg) ** 2)
        return normal(wrapped_deg(yaw_deg - expected), sigma)

    def of(candidate: Candidate) -> float:
        bearing = candidate.bearing_deg
        overshoot = math.copysign(min(config.overshoot_deg, abs(bearing) / 10), bearing)
        full = at(bearing + overshoot, 1.0, candidate)
        partial = math.fsum(at(gain * bearing, gain, candidate) for gain in gains) / GAIN_STEPS
        return config.full_turn * full + (1 - config.full_turn) * partial

    return [of(candidate) for candidate in seen]


def out_of_range_likelihoods(head: HeadObservation, seen: Sequence[Candidate], config: HeadConfig) -> Likelihoods:
    """P(out of range, to that side | POI), over the part of the way that people turn the head."""
    gains = _gains(config)

    def beyond(yaw: float) -> float:
        return rise(yaw - config.range_deg, config.range_soft_deg)

    def of(candidate: Candidate) -> float:
        size = abs(candidate.bearing_deg)
        partial = math.fsum(beyond(gain * size) for gain in gains) / GAIN_STEPS
        turned = config.full_turn * beyond(size) + (1 - config.full_turn) * partial
        return turned * _side_fits(head.side, candidate.bearing_deg)

    return [of(candidate) for candidate in seen]


def _side_fits(side: Side | None, bearing_deg: float) -> float:
    if side is None:
        return 1.0
    # Behind the person left and right meet: a head may turn either way to look there.
    toward = bearing_deg if side == "left" else -bearing_deg
    return max(WRONG_SIDE, rise(min(toward, 180 - toward) if toward > 0 else max(toward, -180 - toward), 3.0))


def _gains(config: HeadConfig) -> list[float]:
    step = (config.gain_max - config.gain_min) / (GAIN_STEPS - 1)
    return [config.gain_min + i * step for i in range(GAIN_STEPS)]


def rise(x: float, width: float) -> float:
    """Logistic step from 0 to 1 at x = 0; most of it within +-`width`."""
    return 1 / (1 + math.exp(max(-50.0, min(50.0, -3 * x / width))))
