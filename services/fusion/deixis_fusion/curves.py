"""How likely what was seen is, for something at each bearing around the person: a curve for the hand and one for the head.

P(observed | the person means something at this bearing), one value a degree. Only ratios count: a density in degrees for
measured angles, a probability where there is none. Every curve has a tail, for each source is nonsense now and then; so none
is 0, and a contradiction is a small number. What is unknown of POIs (their distance, their size) is not in here.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from deixis_schemas.messages import BEARING_STEP_DEG, Side

from .config import HandConfig, HeadConfig
from .confusion import HandConfusion, table_1
from .evidence import HandObservation, HeadObservation
from .pointing import PointingGesture

Values = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Curve = Values

# Between whole degrees: so left and right are mirror images, also where they meet behind.
BEARINGS: Values = np.arange(-179.5, 180.0)
FULL_CIRCLE_DEG = 360.0
# Bearings that are looked up lie within this to either side: half round, and half as far again for a part of a POI.
FARTHEST_DEG = 270.0
# The places in a curve of all degrees as far as that, and of one more to either side.
AROUND = np.arange(-91, 451) % len(BEARINGS)
_BEFORE = int(1.5 * FULL_CIRCLE_DEG - FARTHEST_DEG)
GAIN_STEPS = 8
LOOK_AT_ROBOT_SIGMA_DEG = 8.0
# A side is told wrongly now and then; a zero would make that a total conflict.
WRONG_SIDE = 0.02
# Sine of the bearing within which, ahead and behind, left goes over into right.
SIDE_BORDER = 0.1
SIDE_BORDER_DEG = 3.0
# P(out of range) of a head that looks where no head is out of range: it was read wrongly, or something else was looked at.
LEAST_OUT_OF_RANGE = 0.05


def at(curves: Values, bearings_deg: Singles) -> Singles:
    """Curves (c, v, 360), each v at bearings of its own (v, ...), on a line between its values: (c, v, ...).

    Bearings lie within `FARTHEST_DEG` to either side.
    """
    # Looked up in `AROUND`: a modulo of each bearing takes longer than all else here.
    around = curves.astype(np.float32).take(AROUND, axis=-1)
    steps = np.empty_like(around)
    np.subtract(around[..., 1:], around[..., :-1], out=steps[..., :-1])
    steps[..., -1] = 0
    share = bearings_deg + np.float32(1.5 * FULL_CIRCLE_DEG + 0.5)
    below = share.astype(np.intp)
    share -= below
    below += np.arange(0, steps[0].size, steps.shape[-1]).reshape(-1, *(1,) * (below.ndim - 1)) - _BEFORE
    told = np.empty((len(curves), *bearings_deg.shape), dtype=np.float32)
    for i in range(len(curves)):
        told[i] = steps[i].ravel().take(below)
        told[i] *= share
        told[i] += around[i].ravel().take(below)
    return told


def rise(x: Values, width: float) -> Values:
    """Logistic step from 0 to 1 at x = 0; most of it within +-`width`."""
    return np.asarray(1 / (1 + np.exp(np.clip(-3 * x / width, -50.0, 50.0))))


# --- the hand ---------------------------------------------------------------------------------------------------------


def hand_curve(hand: HandObservation, config: HandConfig, confusion: HandConfusion | None = None) -> Curve:
    """P(gesture | bearing) P(hand's bearing | bearing); by the paper's table 1 where no other is given."""
    return gesture_curve(hand.gesture, config, confusion or table_1()) * bearing_curve(hand, config)


def gesture_curve(gesture: PointingGesture, config: HandConfig, confusion: HandConfusion) -> Curve:
    """P(gesture | bearing): table 1's columns, blended over the borders of the hand's range instead of cut there."""
    size, soft = np.abs(BEARINGS), config.soft_deg
    inside = rise(size - config.min_deg, soft) * rise(config.max_deg - size, soft)
    center, miss = confusion.share(gesture, "center"), config.miss
    left = rise(np.sin(np.radians(BEARINGS)), SIDE_BORDER)
    # Table 1 is of fingers seen well; how often one is missed within its range depends on the camera.
    agrees = {"point_left": left, "point_right": 1 - left, "invisible": np.full_like(left, 0.5)}[gesture]
    beside = np.full_like(left, miss) if gesture == "invisible" else (1 - miss) * agrees
    # In the centre table 1 gives both sides .05 on average: more to a POI that lies a little to the side of the gesture.
    return np.maximum(WRONG_SIDE, inside * beside + (1 - inside) * center * 2 * agrees)


def bearing_curve(hand: HandObservation, config: HandConfig) -> Curve:
    """P(bearing measured at the hand | bearing), per degree, with a uniform tail; 1 where none was measured."""
    if hand.likelihood:
        hit = _blurred(np.array(hand.likelihood), config.sigma_floor_deg)
        return (1 - config.outlier) * hit + config.outlier / FULL_CIRCLE_DEG
    measured = hand.bearings
    if not measured:
        return np.ones_like(BEARINGS)
    # That b and 180 - b look the same is what is seen of a POI at either: the sum, not the mean. So is nonsense.
    hit = sum((normal(bearing, max(sigma, config.sigma_floor_deg)) for bearing, sigma in measured), np.zeros_like(BEARINGS))
    return (1 - config.outlier) * hit + config.outlier * len(measured) / FULL_CIRCLE_DEG


def _blurred(told: Values, sigma_deg: float) -> Curve:
    """The stage's own likelihood of bearings -180, -175 ... 175 as a density, blurred by a normal distribution."""
    return np.asarray(_blur(sigma_deg) @ (told / (np.add.reduce(told) * BEARING_STEP_DEG)))


@lru_cache(maxsize=4)
def _blur(sigma_deg: float) -> Values:
    """Weights of the stage's bearings (n) in each of ours: (360, n), each row summing to 1."""
    off = (BEARINGS[:, None] - np.arange(-180.0, 180.0, BEARING_STEP_DEG) + 180.0) % FULL_CIRCLE_DEG - 180.0
    weights = np.exp(-0.5 * (off / sigma_deg) ** 2)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


# --- the head ---------------------------------------------------------------------------------------------------------


def head_curve(head: HeadObservation, config: HeadConfig) -> Curve:
    """P(yaw | bearing), per degree; of a head beyond its range, P(out of range, to that side | bearing)."""
    if head.yaw_deg is None:
        return np.maximum(LEAST_OUT_OF_RANGE, out_of_range_curve(head, config))
    told = 1 - config.outlier - config.at_robot
    return told * yaw_curve(head.yaw_deg, head.yaw_sigma_deg or 0.0, config) + head_tells_nothing(head, config)


def head_tells_nothing(head: HeadObservation, config: HeadConfig) -> float:
    """P(yaw and a head that does not look at what is meant), per degree: a look at the robot, or nonsense."""
    sigma = math.hypot(head.yaw_sigma_deg or 0.0, LOOK_AT_ROBOT_SIGMA_DEG)
    at_robot = math.exp(-0.5 * ((head.yaw_deg or 0.0) / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))
    return config.at_robot * at_robot + config.outlier / FULL_CIRCLE_DEG


def yaw_curve(yaw_deg: float, yaw_sigma_deg: float, config: HeadConfig) -> Curve:
    """P(yaw | the head looks there), per degree: a mixture over the part of the way that people turn the head.

    The part `full_turn` of them turns all the way, the others any of the gains.
    """
    turned, shares = _turns(config.full_turn, config.overshoot_deg, config.gain_min, config.gain_max)
    variance = yaw_sigma_deg**2 + config.sigma_deg**2
    away = np.abs(yaw_deg - turned)
    np.minimum(away, FULL_CIRCLE_DEG - away, out=away)
    # In place: of all that is reckoned for each frame of a stroke this is the most.
    np.multiply(away, away, out=away)
    away *= -0.5 / variance
    return np.asarray((shares / math.sqrt(2 * math.pi * variance)) @ np.exp(away, out=away))


@lru_cache(maxsize=4)
def _turns(full_turn: float, overshoot_deg: float, gain_min: float, gain_max: float) -> tuple[Values, Values]:
    """How far heads turn to look at each bearing (GAIN_STEPS + 1, 360), degrees: all the way, or a part; the share of each.

    Kept by numbers, for settings are slow to compare.
    """
    overshoot = np.copysign(np.minimum(overshoot_deg, np.abs(BEARINGS) / 10), BEARINGS)
    partial = np.full(GAIN_STEPS, (1 - full_turn) / GAIN_STEPS)
    gains = np.linspace(gain_min, gain_max, GAIN_STEPS)[:, None]
    return np.vstack([BEARINGS + overshoot, gains * BEARINGS]), np.append(full_turn, partial)


def out_of_range_curve(head: HeadObservation, config: HeadConfig) -> Curve:
    """P(out of range, to that side | bearing), over the part of the way that people turn the head."""
    limit = config.range_deg if head.beyond_deg is None else head.beyond_deg
    size = np.abs(BEARINGS)
    full = rise(size - limit, config.range_soft_deg)
    gains = np.linspace(config.gain_min, config.gain_max, GAIN_STEPS)[:, None]
    partial = rise(gains * size - limit, config.range_soft_deg).mean(axis=0)
    return np.asarray((config.full_turn * full + (1 - config.full_turn) * partial) * _side_curve(head.side))


def _side_curve(side: Side | None) -> Curve:
    if side is None:
        return np.ones_like(BEARINGS)
    # Behind the person left and right meet: a head may turn either way to look there.
    toward = BEARINGS if side == "left" else -BEARINGS
    inside = np.where(toward > 0, np.minimum(toward, 180 - toward), np.maximum(toward, -180 - toward))
    return np.maximum(WRONG_SIDE, rise(inside, SIDE_BORDER_DEG))


# --- angles -----------------------------------------------------------------------------------------------------------


def normal(mean_deg: float, sigma_deg: float) -> Curve:
    """Density of a normal distribution around the circle, per degree."""
    return _density(_wrapped(BEARINGS - mean_deg), sigma_deg)


def _density(off_deg: Values, sigma_deg: float) -> Values:
    scaled = off_deg / sigma_deg
    return np.asarray(np.exp(-0.5 * scaled * scaled) / (sigma_deg * math.sqrt(2 * math.pi)))


def _wrapped(angles_deg: Values) -> Values:
    # A modulo takes five times as long.
    return np.asarray(angles_deg - FULL_CIRCLE_DEG * np.rint(angles_deg / FULL_CIRCLE_DEG))
