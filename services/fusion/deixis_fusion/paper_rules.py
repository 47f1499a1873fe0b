"""The paper's rules to the letter (Pateraki et al. 2011, section 6): the hand by eq. 16 and table 1, the head by eq. 18.

With the corrections of its errata: eq. 16 sums over the actual gestures, the hand's range is 40 to 140 degrees. Bearings are
degrees at the person, positive toward the person's own left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .belief import BeliefAssignment, Combination, as_set, members, normalised
from .config import PaperConfig
from .decision import Choice
from .evidence import Evidence, HandObservation, HeadObservation, PointingGesture
from .localisation import wrapped_deg
from .visibility import Candidate

Region = Literal["left", "center", "right"]

# Table 1: P(recognised gesture | region pointed to).
TABLE_1: dict[PointingGesture, dict[Region, float]] = {
    "point_left": {"left": 0.90, "center": 0.05, "right": 0.00},
    "invisible": {"left": 0.10, "center": 0.90, "right": 0.10},
    "point_right": {"left": 0.00, "center": 0.05, "right": 0.90},
}


@dataclass(frozen=True)
class PaperRules:
    """Eqs 16 to 18, and "the POI with the larger mass"."""

    config: PaperConfig

    def hand(self, hand: HandObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 16."""
        limits = (self.config.phi_h_min_deg, self.config.phi_h_max_deg)
        return gesture_sets(hand.gesture, [candidate.bearing_deg for candidate in seen], limits)

    def head(self, head: HeadObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 18; a normal distribution of the yaw stands for the unpublished numbers of fig. 6."""
        bearings = [candidate.bearing_deg for candidate in seen]
        # One range: that of the stage which was read, and of the rules. A yaw beyond it counts as not computed.
        limit = min(self.config.phi_f_max_deg, head.beyond_deg or self.config.phi_f_max_deg)
        far = [abs(bearing) > limit for bearing in bearings]
        if head.yaw_deg is None or abs(head.yaw_deg) > limit:
            return face_assignment([1.0 if is_far else 0.0 for is_far in far], far)
        sigma = math.hypot(self.config.head_sigma_deg, head.yaw_sigma_deg or 0.0)
        likelihoods = [
            0.0 if is_far else normal(wrapped_deg(head.yaw_deg - bearing), sigma)
            for bearing, is_far in zip(bearings, far, strict=True)
        ]
        return face_assignment(likelihoods, None)

    def contour_conflict(self, evidence: Evidence, seen: Sequence[Candidate]) -> float:
        """Of the single POIs' plausibilities; the paper has no such measure."""
        if evidence.hand is None or evidence.head is None:
            return 0.0
        hand, head = self.hand(evidence.hand, seen).plausibilities(), self.head(evidence.head, seen).plausibilities()
        most = max(hand) * max(head)
        return 1 - max(a * b for a, b in zip(hand, head, strict=True)) / most if most > 0 else 1.0

    def choose(self, combination: Combination, _evidence: Evidence, _seen: Sequence[Candidate]) -> Choice:
        """The union of the focal sets of largest mass."""
        return Choice(largest_focal_sets(combination.belief))


def region_of(bearing_deg: float, range_deg: tuple[float, float]) -> Region:
    """The region of section 6.1 that a POI is in: within `range_deg` its pointing hand is recognised, as left or right."""
    if range_deg[0] <= abs(bearing_deg) <= range_deg[1]:
        return "left" if bearing_deg > 0 else "right"
    return "center"


def gesture_sets(gesture: PointingGesture, bearings_deg: Sequence[float], range_deg: tuple[float, float]) -> BeliefAssignment:
    """Eq. 16: masses of the sets of POIs on the left, on the right and in the centre, given the recognised gesture.

    P(G) is the share of the POIs within region G; `range_deg` is (phi_h-min, phi_h-max). Vacuous where the gesture is
    impossible for every POI there is.
    """
    weights: dict[int, float] = {}
    for region, hypotheses in _regions(bearings_deg, range_deg).items():
        weights[as_set(hypotheses)] = TABLE_1[gesture][region] * len(hypotheses) / len(bearings_deg)
    return normalised(len(bearings_deg), weights)


def face_assignment(likelihoods: Sequence[float], far: Sequence[bool] | None) -> BeliefAssignment:
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


def largest_focal_sets(belief: BeliefAssignment) -> tuple[int, ...]:
    """The paper's choice, "the POI with the larger mass": the union of the sets of largest mass, ascending."""
    most = max(belief.masses.values())
    union = 0
    for subset, mass in belief.masses.items():
        if mass >= most - 1e-9:
            union |= subset
    return tuple(members(union))


def normal(distance: float, sigma: float) -> float:
    """Density of a normal distribution at that distance from its mean."""
    return math.exp(-0.5 * (distance / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))


def _regions(bearings_deg: Sequence[float], range_deg: tuple[float, float]) -> dict[Region, list[int]]:
    found: dict[Region, list[int]] = {"left": [], "center": [], "right": []}
    for i, bearing in enumerate(bearings_deg):
        found[region_of(bearing, range_deg)].append(i)
    return {region: hypotheses for region, hypotheses in found.items() if hypotheses}
