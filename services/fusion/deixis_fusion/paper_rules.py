"""The paper's rules to the letter (Pateraki et al. 2011, section 6): the hand by eq. 16, table 1; the head by eq. 18, fig. 6.

With the corrections of its errata: eq. 16 sums over the actual gestures, the hand's range is 40 to 140 degrees. Bearings are
degrees at the person, positive toward the person's own left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .belief import BeliefAssignment, Combination, as_set, members, normalised
from .config import PaperConfig
from .confusion import ConfusionConfig, HandConfusion
from .decision import Choice
from .evidence import Evidence, HandObservation, HeadObservation
from .perceived_yaw import PerceivedYaw
from .pointing import PointingGesture, Region, region_of
from .visibility import Candidate

# Masses that differ by less are equal: they are of one kind of POI, by sums in another order.
SAME_MASS = 1e-9


@dataclass(frozen=True)
class PaperRules:
    """Eqs 16 to 18, and "the POI with the larger mass"."""

    config: PaperConfig
    confusion: ConfusionConfig

    @cached_property
    def perceived(self) -> PerceivedYaw:
        """Fig. 6."""
        return PerceivedYaw.of(self.confusion.head)

    def hand(self, hand: HandObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 16."""
        limits = (self.config.phi_h_min_deg, self.config.phi_h_max_deg)
        return gesture_sets(hand.gesture, [candidate.bearing_deg for candidate in seen], limits, self.confusion.hand)

    def head(self, head: HeadObservation, seen: Sequence[Candidate]) -> BeliefAssignment:
        """Eq. 18. The likelihoods are those of fig. 6 alone, whatever sigma the stage tells."""
        bearings = np.array([candidate.bearing_deg for candidate in seen])
        # One range: that of the stage which was read, and of the rules. A yaw beyond it counts as not computed.
        limit = min(self.config.phi_f_max_deg, head.beyond_deg or self.config.phi_f_max_deg)
        computed = head.yaw_deg is not None and abs(head.yaw_deg) <= limit
        likelihoods = self.perceived.within(limit).likelihoods(head.yaw_deg if computed else None, bearings)
        return face_assignment(likelihoods.tolist(), (np.abs(bearings) > limit).tolist())

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


def gesture_sets(
    gesture: PointingGesture, bearings_deg: Sequence[float], range_deg: tuple[float, float], confusion: HandConfusion
) -> BeliefAssignment:
    """Eq. 16: masses of the sets of POIs on the left, on the right and in the centre, given the recognised gesture.

    P(G) is the share of the POIs within region G; `range_deg` is (phi_h-min, phi_h-max). Vacuous where the gesture is
    impossible for every POI there is.
    """
    weights: dict[int, float] = {}
    for region, hypotheses in _regions(bearings_deg, range_deg).items():
        weights[as_set(hypotheses)] = confusion.share(gesture, region) * len(hypotheses) / len(bearings_deg)
    return normalised(len(bearings_deg), weights)


def face_assignment(likelihoods: Sequence[float], far: Sequence[bool]) -> BeliefAssignment:
    """Eq. 18 with equal priors: mass of each POI proportional to P(observed | POI).

    Those of the POIs beyond the head's range (`far`) together are m_f-O, the mass of their set (eq. 17). Vacuous where what was
    observed is impossible for every POI there is.
    """
    weights = {1 << i: likelihood for i, likelihood in enumerate(likelihoods) if not far[i]}
    beyond = [i for i, is_far in enumerate(far) if is_far]
    if beyond:
        weights[as_set(beyond)] = math.fsum(likelihoods[i] for i in beyond)
    return normalised(len(likelihoods), weights)


def largest_focal_sets(belief: BeliefAssignment) -> tuple[int, ...]:
    """The paper's choice, "the POI with the larger mass": the union of the sets of largest mass, ascending."""
    most = max(belief.masses.values())
    union = 0
    for subset, mass in belief.masses.items():
        if mass >= most - SAME_MASS:
            union |= subset
    return tuple(members(union))


def _regions(bearings_deg: Sequence[float], range_deg: tuple[float, float]) -> dict[Region, list[int]]:
    found: dict[Region, list[int]] = {"left": [], "center": [], "right": []}
    for i, bearing in enumerate(bearings_deg):
        found[region_of(bearing, range_deg)].append(i)
    return {region: hypotheses for region, hypotheses in found.items() if hypotheses}
