"""What the limits cost at which fusion gives no answer: shares of made-up strokes beyond them.

usage: python fitting/abstentions.py [--strokes N]

Strokes are drawn from fusion's own likelihoods: a POI among others all around, a hand with its miss and error, and a head that
looks at the same POI or anywhere. A contour conflict above `answer.max_conflict` is no answer; nor is a lone POI whose
fit is below `answer.least_fit`. No clip is looked at.
"""

from __future__ import annotations

import argparse

import numpy as np
from deixis_fusion.config import FusionConfig
from deixis_fusion.deixis_rules import DeixisRules
from deixis_fusion.evidence import Evidence, HandObservation, HeadObservation, PointingGesture, Witness
from deixis_fusion.localisation import wrapped_deg
from deixis_fusion.visibility import Candidate
from deixis_schemas.messages import Poi

NUMBERS = (2, 8, 20, 100)
BEARING_SIGMA_DEG, HAND_SIGMAS_DEG, YAW_SIGMA_DEG = 4.0, (8.0, 20.0), 4.0
SAID = Witness("ok", "")


def main() -> int:
    """Draw and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strokes", type=int, default=1000, help="for each number of POIs (default: 1000)")
    given = parser.parse_args()
    config, rng = FusionConfig(), np.random.default_rng(1)
    rules = DeixisRules(config.hand, config.head, config.answer)
    for number in NUMBERS:
        for looks in ("at the POI", "anywhere"):
            strokes = [drawn(number, looks == "anywhere", config, rng) for _ in range(given.strokes)]
            conflicts = np.array([rules.contour_conflict(evidence, seen) for seen, evidence in strokes])
            print(
                f"{number:4d} POIs, head looks {looks:10s}: {np.mean(conflicts > config.answer.max_conflict):6.1%} contradict"
            )
    lone = [drawn(1, False, config, rng) for _ in range(given.strokes)]
    lost = np.mean([rules.fit(evidence, seen[0]) < config.answer.least_fit for seen, evidence in lone])
    print(f"   1 POI , head looks at the POI: {lost:6.1%} do not fit")
    return 0


def drawn(number: int, elsewhere: bool, config: FusionConfig, rng: np.random.Generator) -> tuple[list[Candidate], Evidence]:
    """POIs all around, and what is seen of a person who means the first."""
    bearings = rng.uniform(-170, 170, number)
    seen = [Candidate(Poi(poi_id=f"P{i}", position_m=(0, 0, 0)), float(b), BEARING_SIGMA_DEG) for i, b in enumerate(bearings)]
    return seen, Evidence(_hand(bearings[0], config, rng), SAID, _head(bearings[0], elsewhere, config, rng), SAID)


def _hand(bearing: float, config: FusionConfig, rng: np.random.Generator) -> HandObservation:
    beside = config.hand.min_deg < abs(bearing) < config.hand.max_deg
    gesture: PointingGesture = "point_left" if bearing > 0 else "point_right"
    if rng.random() < (config.hand.miss if beside else 0.9):
        gesture = "invisible"
    sigma = float(rng.uniform(*HAND_SIGMAS_DEG))
    measured = rng.uniform(-180, 180) if rng.random() < config.hand.outlier else bearing + rng.normal(0, sigma)
    return HandObservation(gesture, wrapped_deg(float(measured)), sigma)


def _head(bearing: float, elsewhere: bool, config: FusionConfig, rng: np.random.Generator) -> HeadObservation:
    head = config.head
    gain = 1.0 if rng.random() < head.full_turn else rng.uniform(head.gain_min, head.gain_max)
    yaw = rng.uniform(-100, 100) if elsewhere else gain * bearing + rng.normal(0, head.sigma_deg)
    if abs(yaw) > head.range_deg:
        return HeadObservation(None, None, "left" if yaw > 0 else "right")
    return HeadObservation(float(yaw + rng.normal(0, YAW_SIGMA_DEG)), YAW_SIGMA_DEG)


if __name__ == "__main__":
    raise SystemExit(main())
