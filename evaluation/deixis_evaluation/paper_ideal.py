"""The most that any rules can do with the readings of the paper's simulation: Bayes' rule, by one who knows how they are drawn.

Table 1, figure 6 and the error of the hand's bearing are those of `paper_trials.py`; all visible POIs are alike beforehand, as
they are there. Whoever names one POI each time is right most often by naming the likeliest: Cors of nobody's rules is above
this one's, but by the chance of the draw.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from deixis_fusion.config import FusionConfig
from deixis_fusion.perceived_yaw import PerceivedYaw
from deixis_fusion.pointing import GESTURES

from .paper_deixis import Readings
from .paper_masses import Answers
from .paper_trials import FULL_CIRCLE_DEG, HAND_SIGMA_DEG, Trials, hand_shares, regions

Values = npt.NDArray[np.float64]


def ideal_answers(trials: Trials, perceived: PerceivedYaw, config: FusionConfig, readings: Readings) -> Answers:
    """The likeliest POI of each trial, and its probability. `perceived` is figure 6 within the head's range."""
    likelihoods = _of_hand(trials, config, readings) * _of_head(trials, perceived, readings) * trials.arrangements.visible
    named = likelihoods.argmax(axis=1)
    belief = likelihoods.max(axis=1) / likelihoods.sum(axis=1)
    return Answers(np.asarray(1 << named, dtype=np.int64), belief)


def _of_hand(trials: Trials, config: FusionConfig, readings: Readings) -> Values:
    """P(gesture, and where it is told the hand's bearing | POI): (t, n)."""
    bearings = trials.arrangements.bearing_deg
    shares = hand_shares(config)[trials.gesture[:, None], regions(bearings, config)]
    if not readings.hand_bearing:
        return np.asarray(shares)
    # Front and back look alike: either may have been measured.
    told = sum(_density(measured[:, None] - bearings) for measured in (trials.hand_deg, 180 - trials.hand_deg))
    shown = trials.gesture != GESTURES.index("invisible")
    return np.asarray(np.where(shown[:, None], shares * told, shares))


def _of_head(trials: Trials, perceived: PerceivedYaw, readings: Readings) -> Values:
    """P(yaw, or not computed and where it is told the side | POI): (t, n)."""
    bearings = trials.arrangements.bearing_deg
    shares = np.take_along_axis(perceived.distributions(bearings), trials.yaw[None, :, None], axis=0)[0]
    if not readings.head_side:
        return np.asarray(shares)
    other_side = (bearings > 0) != trials.turned_left[:, None]
    return np.asarray(np.where((trials.yaw == len(perceived.yaw_deg))[:, None] & other_side, 0.0, shares))


def _density(off_deg: Values) -> Values:
    wrapped = (off_deg + FULL_CIRCLE_DEG / 2) % FULL_CIRCLE_DEG - FULL_CIRCLE_DEG / 2
    return np.asarray(np.exp(-0.5 * (wrapped / HAND_SIGMA_DEG) ** 2))
