"""Our rules, beyond the paper's: every POI is weighed by the likelihood of what was seen given its bearing.

The head turns only part of the way, and part of the mass stays on the sets of eq. 16 and on the whole frame, so that one
wrong source is never a total conflict. Bearings are degrees at the person, positive toward the person's own left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from deixis_schemas.messages import Side

from .belief import BeliefAssignment, Combination, as_set, everything_of, normalised, vacuous
from .config import AnswerConfig, HandConfig, HeadConfig
from .decision import Choice
from .evidence import HandObservation, HeadObservation, PointingGesture
from .localisation import wrapped_deg
from .paper_rules import TABLE_1, gesture_sets, normal
from .visibility import Candidate

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
class DeixisRules:
    """Likelihoods of hand and head; the answer is what is likeliest, with ties and abstentions."""

    hand_config: HandConfig
    head_config: HeadConfig
    answer: AnswerConfig

    def hand(self, hand: HandObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 16 refined by the hand's bearing."""
        return hand_assignment(hand, seen, self.hand_config)

    def head(self, head: HeadObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 18 with a head that turns part of the way."""
        return head_assignment(head, seen, self.head_config)

    def choose(self, combination: Combination) -> Choice:
        """The POIs of largest pignistic probability, unless hand and head contradict each other or too many are tied."""
        if combination.conflict > self.answer.max_conflict:
            return Choice((), f"hand and head contradict each other (conflict {combination.conflict:.2f})")
        tied = best_by_pignistic(combination.belief, self.answer.tie_margin)
        if len(tied) > self.answer.max_ties:
            return Choice((), f"{len(tied)} POIs are equally likely")
        return Choice(tied)


def best_by_pignistic(belief: BeliefAssignment, tie_margin: float) -> tuple[int, ...]:
    """The hypotheses whose pignistic probability is within `tie_margin` of the largest, best first."""
    pignistic = belief.pignistic()
    order = sorted(range(belief.size), key=lambda i: (-pignistic[i], i))
    return tuple(i for i in order if pignistic[order[0]] - pignistic[i] < tie_margin or i == order[0])


# --- the hand ---------------------------------------------------------------------------------------------------------


def hand_assignment(hand: HandObservation, seen: Sequence[Candidate], config: HandConfig) -> BeliefAssignment:
    """Eq. 16 refined by the bearing of the hand.

    The sets of eq. 16 keep part of their mass. The rest goes to single POIs by P(gesture | bearing) P(hand's bearing |
    bearing): table 1 with soft borders, times a likelihood with a tail. Without a bearing and with hard borders the single
    masses of a region sum to its mass by eq. 16, so the refinement adds what the bearing tells and nothing else.
    """
    bearings = [candidate.bearing_deg for candidate in seen]
    size = len(bearings)
    weights = [_gesture_likelihood(hand.gesture, bearing, config) for bearing in bearings]
    measured = [bearing for bearing in (hand.bearing_deg, hand.mirror_deg) if bearing is not None]
    if measured:
        sigma = max(hand.bearing_sigma_deg or 0.0, config.sigma_floor_deg)
        likelihoods = [_hand_likelihood(measured, sigma, candidate, config.outlier) for candidate in seen]
        weights = [weight * likelihood for weight, likelihood in zip(weights, likelihoods, strict=True)]
    single = normalised(size, {1 << i: weight for i, weight in enumerate(weights)})
    sets = gesture_sets(hand.gesture, bearings, (config.min_deg, config.max_deg))
    return _mixed(single, sets, config.refinement).discounted(_rate(config.discount, hand.agreement))


def _gesture_likelihood(gesture: PointingGesture, bearing_deg: float, config: HandConfig) -> float:
    """P(gesture | bearing): table 1's columns, blended over the borders of the hand's range instead of cut there."""
    size = abs(bearing_deg)
    soft = config.soft_deg
    inside = _rise(size - config.min_deg, soft) * _rise(config.max_deg - size, soft)
    row, miss = TABLE_1[gesture], config.miss
    left = _rise(math.sin(math.radians(bearing_deg)), SIDE_BORDER)
    # Table 1 is of fingers seen well; how often one is missed within its range depends on the camera.
    beside = {"point_left": (1 - miss) * left, "point_right": (1 - miss) * (1 - left), "invisible": miss}[gesture]
    # In the centre table 1 gives both sides .05 on average: more to a POI that lies a little to the side of the gesture.
    agrees = {"point_left": 2 * left, "point_right": 2 * (1 - left), "invisible": 1.0}[gesture]
    return max(WRONG_SIDE, inside * beside + (1 - inside) * row["center"] * agrees)


def _hand_likelihood(measured: Sequence[float], sigma: float, candidate: Candidate, outlier: float) -> float:
    """P(bearing measured at the hand | POI), per degree, with a uniform tail; two bearings where it is mirrored."""
    spread = math.hypot(sigma, candidate.bearing_sigma_deg)
    hit = sum(normal(wrapped_deg(value - candidate.bearing_deg), spread) for value in measured) / len(measured)
    return (1 - outlier) * hit + outlier / FULL_CIRCLE_DEG


# --- the head ---------------------------------------------------------------------------------------------------------


def head_assignment(head: HeadObservation, seen: Sequence[Candidate], config: HeadConfig) -> BeliefAssignment:
    """Eq. 18 with a head that turns only part of the way; beyond its range, mass on the POIs out there.

    Yaws that fit no POI, and yaws that fit a look at the robot, leave their mass on the whole frame: the head then says
    nothing, instead of choosing the least bad POI with full confidence.
    """
    rate = _rate(config.discount, head.agreement)
    if head.yaw_deg is None:
        return _out_of_range(head, seen, config).discounted(rate)
    size = len(seen)
    sigma = head.yaw_sigma_deg or 0.0
    told, gains = 1 - config.outlier - config.at_robot, _gains(config)
    weights = {
        1 << i: told / size * _head_likelihood(head.yaw_deg, sigma, candidate, gains, config)
        for i, candidate in enumerate(seen)
    }
    at_robot = normal(head.yaw_deg, math.hypot(sigma, LOOK_AT_ROBOT_SIGMA_DEG))
    everything = everything_of(size)
    nothing_told = config.at_robot * at_robot + config.outlier / FULL_CIRCLE_DEG
    weights[everything] = weights.get(everything, 0.0) + nothing_told
    return normalised(size, weights).discounted(rate)


def _head_likelihood(
    yaw_deg: float, yaw_sigma_deg: float, candidate: Candidate, gains: Sequence[float], config: HeadConfig
) -> float:
    """P(yaw | POI), per degree: a mixture over the part of the way that people turn the head.

    The part `full_turn` of them turns all the way, the others any of the `gains`.
    """
    bearing = candidate.bearing_deg

    def at(expected: float, gain: float) -> float:
        sigma = math.sqrt(yaw_sigma_deg**2 + config.sigma_deg**2 + (gain * candidate.bearing_sigma_deg) ** 2)
        return normal(wrapped_deg(yaw_deg - expected), sigma)

    overshoot = math.copysign(min(config.overshoot_deg, abs(bearing) / 10), bearing)
    full = at(bearing + overshoot, 1.0)
    partial = math.fsum(at(gain * bearing, gain) for gain in gains) / GAIN_STEPS
    return config.full_turn * full + (1 - config.full_turn) * partial


def _out_of_range(head: HeadObservation, seen: Sequence[Candidate], config: HeadConfig) -> BeliefAssignment:
    """Section 6.2: the head is turned beyond its range. Nested sets, the POIs that are surely out there innermost."""
    gains = _gains(config)
    possible = [
        _beyond_range(candidate.bearing_deg, gains, config) * _side_fits(head.side, candidate.bearing_deg) for candidate in seen
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


def _beyond_range(bearing_deg: float, gains: Sequence[float], config: HeadConfig) -> float:
    """P(out of range | POI at this bearing), over the part of the way that people turn the head."""

    def beyond(yaw: float) -> float:
        return _rise(yaw - config.range_deg, config.range_soft_deg)

    size = abs(bearing_deg)
    partial = math.fsum(beyond(gain * size) for gain in gains) / GAIN_STEPS
    return config.full_turn * beyond(size) + (1 - config.full_turn) * partial


def _side_fits(side: Side | None, bearing_deg: float) -> float:
    if side is None:
        return 1.0
    # Behind the person left and right meet: a head may turn either way to look there.
    toward = bearing_deg if side == "left" else -bearing_deg
    return max(WRONG_SIDE, _rise(min(toward, 180 - toward) if toward > 0 else max(toward, -180 - toward), 3.0))


def _gains(config: HeadConfig) -> list[float]:
    step = (config.gain_max - config.gain_min) / (GAIN_STEPS - 1)
    return [config.gain_min + i * step for i in range(GAIN_STEPS)]


def _mixed(first: BeliefAssignment, second: BeliefAssignment, share: float) -> BeliefAssignment:
    """`share` of the first, the rest of the second."""
    weights = {subset: share * mass for subset, mass in first.masses.items()}
    for subset, mass in second.masses.items():
        weights[subset] = weights.get(subset, 0.0) + (1 - share) * mass
    return normalised(first.size, weights)


def _rate(discount: float, agreement: float) -> float:
    """Discount of a source: its own, and more where the frames of a stroke disagree."""
    return min(1.0, 1 - (1 - discount) * (0.5 + 0.5 * min(1.0, max(0.0, agreement))))


def _rise(x: float, width: float) -> float:
    """Logistic step from 0 to 1 at x = 0; most of it within +-`width`."""
    return 1 / (1 + math.exp(max(-50.0, min(50.0, -3 * x / width))))
