"""What was observed, as basic belief assignments: the hand by eq. 16 and table 1, the head by eq. 18.

Two sets of rules. `paper_*` are the paper's to the letter (with the corrections of its errata: eq. 16 sums over the actual
gestures, the hand's range is 40 to 140 degrees). `hand_assignment` and `head_assignment` go beyond it: every POI is weighed by
the likelihood of what was seen given its bearing, with a head that turns only part of the way, and part of the mass stays
on the paper's sets and on the whole frame, so that one wrong source is never a total conflict.

Bearings are degrees at the person, positive toward the person's own left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from deixis_schemas.messages import Side

from .belief import BeliefAssignment, as_set, everything_of, normalised, vacuous
from .config import FusionConfig
from .discernment import Candidate

Region = Literal["left", "center", "right"]
PointingGesture = Literal["point_left", "invisible", "point_right"]

# Table 1: P(recognised gesture | region pointed to).
TABLE_1: dict[PointingGesture, dict[Region, float]] = {
    "point_left": {"left": 0.90, "center": 0.05, "right": 0.00},
    "invisible": {"left": 0.10, "center": 0.90, "right": 0.10},
    "point_right": {"left": 0.00, "center": 0.05, "right": 0.90},
}

FULL_CIRCLE_DEG = 360.0
GAIN_STEPS = 8
LOOK_AT_ROBOT_SIGMA_DEG = 8.0
# A side is told wrongly now and then; a zero would make that a total conflict.
WRONG_SIDE = 0.02
# Sine of the bearing within which, ahead and behind, left goes over into right.
SIDE_BORDER = 0.1
POSSIBILITY_LEVELS = 5
LEAST_OUT_OF_RANGE = 0.05


@dataclass(frozen=True)
class HandObservation:
    """A pointing stroke: the gesture recognised and, where it could be told, the bearing pointed to.

    `mirrored`: the bearing may as well be 180 - bearing. `agreement` is the share of the frames that said so.
    """

    gesture: PointingGesture
    bearing_deg: float | None = None
    bearing_sigma_deg: float | None = None
    mirrored: bool = False
    agreement: float = 1.0


@dataclass(frozen=True)
class HeadObservation:
    """A tracked head: its yaw, or (`yaw_deg` none) that it is turned beyond the range, to `side` where that is known."""

    yaw_deg: float | None
    yaw_sigma_deg: float | None = None
    side: Side | None = None
    agreement: float = 1.0


# --- the paper's rules ------------------------------------------------------------------------------------------------


def region_of(bearing_deg: float, range_deg: tuple[float, float]) -> Region:
    """The region of section 6.1 that a POI is in: within `range_deg` its pointing hand is recognised, as left or right."""
    if range_deg[0] <= abs(bearing_deg) <= range_deg[1]:
        return "left" if bearing_deg > 0 else "right"
    return "center"


def paper_hand_assignment(
    gesture: PointingGesture, bearings_deg: Sequence[float], range_deg: tuple[float, float]
) -> BeliefAssignment:
    """Eq. 16: masses of the sets of POIs on the left, on the right and in the centre, given the recognised gesture.

    P(G) is the share of the POIs within region G; `range_deg` is (phi_h-min, phi_h-max). Vacuous where the gesture is
    impossible for every POI there is.
    """
    weights: dict[int, float] = {}
    for region, hypotheses in _regions(bearings_deg, range_deg).items():
        weights[as_set(hypotheses)] = TABLE_1[gesture][region] * len(hypotheses) / len(bearings_deg)
    return normalised(len(bearings_deg), weights)


def paper_face_assignment(likelihoods: Sequence[float], far: Sequence[bool] | None) -> BeliefAssignment:
    """Eq. 18 with equal priors: mass of each POI proportional to P(observed | POI).

    `far` is none for a computed orientation. For "not computed" it tells which POIs lie beyond the head's range: their
    masses together are m_f-O, the mass of their set (eq. 17).
    """
    weights: dict[int, float] = {}
    if far is None:
        weights = {1 << i: likelihood for i, likelihood in enumerate(likelihoods)}
        return normalised(len(likelihoods), weights)
    near = [i for i, is_far in enumerate(far) if not is_far]
    beyond = [i for i, is_far in enumerate(far) if is_far]
    weights = {1 << i: likelihoods[i] for i in near}
    beyond_set = as_set(beyond)
    if beyond_set:
        weights[beyond_set] = weights.get(beyond_set, 0.0) + math.fsum(likelihoods[i] for i in beyond)
    return normalised(len(likelihoods), weights)


def paper_head_assignment(head: HeadObservation, bearings_deg: Sequence[float], config: FusionConfig) -> BeliefAssignment:
    """Eq. 18 for a head as observed; a normal distribution of the yaw stands for the unpublished numbers of fig. 6."""
    far = [abs(bearing) > config.phi_f_max_deg for bearing in bearings_deg]
    if head.yaw_deg is None:
        return paper_face_assignment([1.0 if is_far else 0.0 for is_far in far], far)
    sigma = math.hypot(config.paper_head_sigma_deg, head.yaw_sigma_deg or 0.0)
    likelihoods = [
        0.0 if is_far else _normal(wrapped_deg(head.yaw_deg - bearing), sigma)
        for bearing, is_far in zip(bearings_deg, far, strict=True)
    ]
    return paper_face_assignment(likelihoods, None)


# --- ours: the hand ---------------------------------------------------------------------------------------------------


def hand_assignment(hand: HandObservation, seen: Sequence[Candidate], config: FusionConfig) -> BeliefAssignment:
    """Eq. 16 refined by the bearing of the hand.

    The sets of eq. 16 keep part of their mass. The rest goes to single POIs by P(gesture | bearing) P(hand's bearing |
    bearing): table 1 with soft borders, times a likelihood with a tail. Without a bearing and with hard borders the single
    masses of a region sum to its mass by eq. 16, so the refinement adds what the bearing tells and nothing else.
    """
    bearings = [candidate.bearing_deg for candidate in seen]
    size = len(bearings)
    weights = [_gesture_likelihood(hand.gesture, bearing, config) for bearing in bearings]
    if hand.bearing_deg is not None:
        weights = [w * _hand_likelihood(hand, candidate, config) for w, candidate in zip(weights, seen, strict=True)]
    single = normalised(size, {1 << i: weight for i, weight in enumerate(weights)})
    sets = paper_hand_assignment(hand.gesture, bearings, (config.hand_min_deg, config.hand_max_deg))
    return _mixed(single, sets, config.hand_refinement).discounted(_rate(config.hand_discount, hand.agreement))


def _gesture_likelihood(gesture: PointingGesture, bearing_deg: float, config: FusionConfig) -> float:
    """P(gesture | bearing): table 1's columns, blended over the borders of the hand's range instead of cut there."""
    size = abs(bearing_deg)
    soft = config.hand_soft_deg
    inside = _rise(size - config.hand_min_deg, soft) * _rise(config.hand_max_deg - size, soft)
    row, miss = TABLE_1[gesture], config.hand_miss
    left = _rise(math.sin(math.radians(bearing_deg)), SIDE_BORDER)
    # Table 1 is of fingers seen well; how often one is missed within its range depends on the camera.
    beside = {"point_left": (1 - miss) * left, "point_right": (1 - miss) * (1 - left), "invisible": miss}[gesture]
    # In the centre table 1 gives both sides .05 on average: more to a POI that lies a little to the side of the gesture.
    agrees = {"point_left": 2 * left, "point_right": 2 * (1 - left), "invisible": 1.0}[gesture]
    return max(WRONG_SIDE, inside * beside + (1 - inside) * row["center"] * agrees)


def _hand_likelihood(hand: HandObservation, candidate: Candidate, config: FusionConfig) -> float:
    """P(bearing measured at the hand | POI), per degree, with a uniform tail."""
    assert hand.bearing_deg is not None
    sigma = math.hypot(max(hand.bearing_sigma_deg or 0.0, config.hand_sigma_floor_deg), candidate.bearing_sigma_deg)
    measured = [hand.bearing_deg]
    if hand.mirrored:
        measured.append(180.0 - hand.bearing_deg)
    hit = sum(_normal(wrapped_deg(value - candidate.bearing_deg), sigma) for value in measured) / len(measured)
    return (1 - config.hand_outlier) * hit + config.hand_outlier / FULL_CIRCLE_DEG


# --- ours: the head ---------------------------------------------------------------------------------------------------


def head_assignment(head: HeadObservation, seen: Sequence[Candidate], config: FusionConfig) -> BeliefAssignment:
    """Eq. 18 with a head that turns only part of the way; beyond its range, mass on the POIs out there.

    Yaws that fit no POI, and yaws that fit a look at the robot, leave their mass on the whole frame: the head then says
    nothing, instead of choosing the least bad POI with full confidence.
    """
    rate = _rate(config.head_discount, head.agreement)
    if head.yaw_deg is None:
        return _out_of_range(head, seen, config).discounted(rate)
    size = len(seen)
    sigma = head.yaw_sigma_deg or 0.0
    told = 1 - config.head_outlier - config.head_at_robot
    weights = {
        1 << i: told / size * head_likelihood(head.yaw_deg, sigma, candidate, config) for i, candidate in enumerate(seen)
    }
    at_robot = _normal(head.yaw_deg, math.hypot(sigma, LOOK_AT_ROBOT_SIGMA_DEG))
    everything = everything_of(size)
    nothing_told = config.head_at_robot * at_robot + config.head_outlier / FULL_CIRCLE_DEG
    weights[everything] = weights.get(everything, 0.0) + nothing_told
    return normalised(size, weights).discounted(rate)


def head_likelihood(yaw_deg: float, yaw_sigma_deg: float, candidate: Candidate, config: FusionConfig) -> float:
    """P(yaw | POI), per degree: a mixture over the part of the way that people turn the head.

    Half of them (`head_full_turn`) turn all the way, the others anything from `head_gain_min` to `head_gain_max`.
    """
    bearing = candidate.bearing_deg

    def at(expected: float, gain: float) -> float:
        sigma = math.sqrt(yaw_sigma_deg**2 + config.head_sigma_deg**2 + (gain * candidate.bearing_sigma_deg) ** 2)
        return _normal(wrapped_deg(yaw_deg - expected), sigma)

    overshoot = math.copysign(min(config.head_overshoot_deg, abs(bearing) / 10), bearing)
    full = at(bearing + overshoot, 1.0)
    partial = math.fsum(at(gain * bearing, gain) for gain in _gains(config)) / GAIN_STEPS
    return config.head_full_turn * full + (1 - config.head_full_turn) * partial


def _out_of_range(head: HeadObservation, seen: Sequence[Candidate], config: FusionConfig) -> BeliefAssignment:
    """Section 6.2: the head is turned beyond its range. Nested sets, the POIs that are surely out there innermost."""
    possible = [
        _beyond_range(candidate.bearing_deg, config) * _side_fits(head.side, candidate.bearing_deg) for candidate in seen
    ]
    most = max(possible)
    if most < LEAST_OUT_OF_RANGE:
        return vacuous(len(seen))
    return consonant([value / most for value in possible])


def consonant(possibilities: Sequence[float]) -> BeliefAssignment:
    """The nested assignment whose plausibilities are these possibilities (the largest is 1), in five levels."""
    size = len(possibilities)
    weights: dict[int, float] = {}
    for level in range(POSSIBILITY_LEVELS, 0, -1):
        threshold = (level - 0.5) / POSSIBILITY_LEVELS
        subset = as_set(i for i, value in enumerate(possibilities) if value >= threshold)
        weights[subset] = weights.get(subset, 0.0) + 1 / POSSIBILITY_LEVELS
    return normalised(size, weights)


def _beyond_range(bearing_deg: float, config: FusionConfig) -> float:
    """P(out of range | POI at this bearing), over the part of the way that people turn the head."""

    def beyond(yaw: float) -> float:
        return _rise(yaw - config.head_range_deg, config.head_range_soft_deg)

    size = abs(bearing_deg)
    partial = math.fsum(beyond(gain * size) for gain in _gains(config)) / GAIN_STEPS
    return config.head_full_turn * beyond(size) + (1 - config.head_full_turn) * partial


def _side_fits(side: Side | None, bearing_deg: float) -> float:
    if side is None:
        return 1.0
    # Behind the person left and right meet: a head may turn either way to look there.
    toward = bearing_deg if side == "left" else -bearing_deg
    return max(WRONG_SIDE, _rise(min(toward, 180 - toward) if toward > 0 else max(toward, -180 - toward), 3.0))


def _gains(config: FusionConfig) -> list[float]:
    step = (config.head_gain_max - config.head_gain_min) / (GAIN_STEPS - 1)
    return [config.head_gain_min + i * step for i in range(GAIN_STEPS)]


# --- shared -----------------------------------------------------------------------------------------------------------


def wrapped_deg(angle: float) -> float:
    """The same angle within -180 and 180 degrees."""
    return (angle + 180.0) % FULL_CIRCLE_DEG - 180.0


def _regions(bearings_deg: Sequence[float], range_deg: tuple[float, float]) -> dict[Region, list[int]]:
    found: dict[Region, list[int]] = {"left": [], "center": [], "right": []}
    for i, bearing in enumerate(bearings_deg):
        found[region_of(bearing, range_deg)].append(i)
    return {region: hypotheses for region, hypotheses in found.items() if hypotheses}


def _mixed(first: BeliefAssignment, second: BeliefAssignment, share: float) -> BeliefAssignment:
    """`share` of the first, the rest of the second."""
    weights = {subset: share * mass for subset, mass in first.masses.items()}
    for subset, mass in second.masses.items():
        weights[subset] = weights.get(subset, 0.0) + (1 - share) * mass
    return normalised(first.size, weights)


def _rate(discount: float, agreement: float) -> float:
    """Discount of a source: its own, and more where the frames of a stroke disagree."""
    return min(1.0, 1 - (1 - discount) * (0.5 + 0.5 * min(1.0, max(0.0, agreement))))


def _normal(distance: float, sigma: float) -> float:
    return math.exp(-0.5 * (distance / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))


def _rise(x: float, width: float) -> float:
    """Logistic step from 0 to 1 at x = 0; most of it within +-`width`."""
    return 1 / (1 + math.exp(max(-50.0, min(50.0, -3 * x / width))))
