"""What the robot reads of the hand and of the head in each arrangement, drawn from table 1 and figure 6 (section 7.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from deixis_fusion.config import FusionConfig
from deixis_fusion.perceived_yaw import PerceivedYaw
from deixis_fusion.pointing import GESTURES, REGIONS

from .paper_arrangements import Arrangements

Values = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

HAND_SIGMA_DEG = 15.0
"""Of a hand's bearing: the gesture stage errs by 10 degrees (median) on others, `python fitting/fit_arms.py --check`."""
BEARING_STEP_DEG = 1.0
FULL_CIRCLE_DEG = 360.0


@dataclass(frozen=True, eq=False)
class Trials:
    """t readings: `gesture` (t) of GESTURES, `yaw` (t) a row of `PerceivedYaw`, its last one "not computed".

    What the paper's sensors do not tell and our stages do: `hand_deg` (t), the bearing of the hand, in whole degrees;
    `turned_left` (t), to which side a head is turned that could not be computed. `at_robot` (t): the head looks at the robot.
    """

    arrangements: Arrangements
    gesture: Indices
    yaw: Indices
    hand_deg: Values
    turned_left: Flags
    at_robot: Flags

    def __len__(self) -> int:
        return len(self.gesture)


def perceive(
    arrangements: Arrangements, perceived: PerceivedYaw, config: FusionConfig, mismatch: float, rng: np.random.Generator
) -> Trials:
    """Draw the readings; the share `mismatch` of heads looks at the robot. `perceived` is figure 6 within the head's range."""
    meant, count = arrangements.meant_deg, len(arrangements)
    at_robot = rng.random(count) < mismatch
    looks_at = np.where(at_robot, 0.0, meant)
    hand_deg = np.round((meant + rng.normal(0, HAND_SIGMA_DEG, count)) / BEARING_STEP_DEG) * BEARING_STEP_DEG
    return Trials(
        arrangements=arrangements,
        gesture=_chosen(hand_shares(config)[:, regions(meant, config)], rng),
        yaw=_chosen(perceived.distributions(looks_at), rng),
        hand_deg=(hand_deg + FULL_CIRCLE_DEG / 2) % FULL_CIRCLE_DEG - FULL_CIRCLE_DEG / 2,
        turned_left=looks_at > 0,
        at_robot=at_robot,
    )


def hand_shares(config: FusionConfig) -> Values:
    """Table 1 (gestures, regions); its columns sum to 1."""
    table = np.array([[config.confusion.hand.share(gesture, region) for region in REGIONS] for gesture in GESTURES])
    return np.asarray(table / table.sum(axis=0))


def regions(bearings_deg: Values, config: FusionConfig) -> Indices:
    """The region (of REGIONS) that each bearing is in, as `deixis_fusion.pointing.region_of` has it."""
    size = np.abs(bearings_deg)
    beside = (size >= config.paper.phi_h_min_deg) & (size <= config.paper.phi_h_max_deg)
    side = np.where(bearings_deg > 0, REGIONS.index("left"), REGIONS.index("right"))
    return np.where(beside, side, REGIONS.index("center"))


def _chosen(shares: Values, rng: np.random.Generator) -> Indices:
    """One row of each column (rows, t) of probabilities."""
    limits = shares.cumsum(axis=0)
    limits[-1] = 1.0  # not short of it by rounding
    return np.asarray((rng.random(shares.shape[1]) >= limits).sum(axis=0))
