"""Chooses what the paper leaves open of its simulation: the size of the rooms A and B, how far apart robot and person stand,
and two numbers of figure 6.

usage: python fitting/choose_paper.py [--trials N] [--seed S]

By table 3 in the rooms A and B (V_h, C_h, V_f and C_f / V_f), which tells of arrangements and of each source alone, not of
fusion: chi2 is the sum of the 8 squared differences, each beside what 1000 trials scatter by. What table 2 then says is a
result. The best was taken, marked *; those less than 1 above it are as good. Room C is left out, for its plan is more of a
guess. About three minutes.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import numpy as np
from deixis_evaluation.paper_arrangements import FARTHEST_M, NEAREST_M, Arrangements, draw
from deixis_evaluation.paper_figures import PUBLISHED, Counts, count
from deixis_evaluation.paper_masses import answers, dempster, sources
from deixis_evaluation.paper_rooms import HALL_M, room_a, room_b
from deixis_evaluation.paper_trials import perceive
from deixis_fusion.config import FusionConfig
from deixis_fusion.confusion import HeadConfusion
from deixis_fusion.perceived_yaw import PerceivedYaw
from reconstruct_fig_6 import AT_LIMIT, INTENDED, PERCEIVED, UNREAD, reconstructed

SIZES_M = ((6.0, 5.0), (7.0, 6.0), (8.0, 6.0), (8.0, 7.0), (9.0, 7.0), (10.0, 8.0))
APART_M = (1.5, 2.0, 2.5, 3.0, 4.0)
SUCCESSES = (0.52, 0.55, 0.6, 0.65)
UNREADS = (0.03, 0.05, 0.07)
SHOWN = 15


class Choice(NamedTuple):
    """Room, distance and figure 6, and how far table 3 is off."""

    chi2: float
    size_m: tuple[float, float]
    farthest_m: float
    at_limit: float
    unread: float


def main() -> int:
    """Print the best choices."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20000, help="in each room, for each choice (default: 20000)")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    taken = (HALL_M, FARTHEST_M, AT_LIMIT, UNREAD)
    for choice in sorted(choices(given.trials, given.seed))[:SHOWN]:
        (width, depth), farthest, at_limit, unread = choice[1:]
        print(
            f"{'*' if choice[1:] == taken else ' '} chi2 {choice.chi2:5.2f}: {width:g} x {depth:g} m, "
            f"{NEAREST_M:g} to {farthest:g} m apart; success {at_limit:g} at 120 degrees, {unread:g} of the errors unread"
        )
    return 0


def choices(trials: int, seed: int) -> Iterable[Choice]:
    """All of them, weighed."""
    for size, farthest in product(SIZES_M, APART_M):
        rng = np.random.default_rng(seed)
        drawn = [(room.name, draw(room, trials, rng, (NEAREST_M, farthest))) for room in (room_a(*size), room_b(*size))]
        for at_limit, unread in product(SUCCESSES, UNREADS):
            figure = figure_of(at_limit, unread)
            off = sum(chi2(counts(of_room, figure, seed), PUBLISHED[name]) for name, of_room in drawn)
            yield Choice(off, size, farthest, at_limit, unread)


def figure_of(at_limit: float, unread: float) -> HeadConfusion:
    """Figure 6 with these numbers."""
    table = reconstructed(at_limit, unread)
    content = {"intended_deg": list(INTENDED), "perceived_deg": list(PERCEIVED)}
    return HeadConfusion.model_validate(content | {"table": table[:-1].tolist(), "not_computed": table[-1].tolist()})


def counts(drawn: Arrangements, figure: HeadConfusion, seed: int) -> Counts:
    """Tables 2 and 3."""
    config = FusionConfig.model_validate({"confusion": {"head": figure}})
    perceived = PerceivedYaw.of(figure).within(config.paper.phi_f_max_deg)
    trials = perceive(drawn, perceived, config, 0.0, np.random.default_rng(seed))
    both = sources(trials, perceived, config)
    return count(trials, both, perceived, answers(dempster(both)), config)


def chi2(ours: Counts, published: Counts) -> float:
    """How far table 3 is off, by what as many trials as the paper's scatter."""
    pairs: list[tuple[float, int, int]] = [
        (getattr(ours, row) / ours.trials, getattr(published, row), published.trials) for row in ("vh", "ch", "vf")
    ]
    pairs.append((ours.cf / ours.vf, published.cf, published.vf))
    return math.fsum((hits / total - share) ** 2 / (share * (1 - share) / total) for share, hits, total in pairs)


if __name__ == "__main__":
    raise SystemExit(main())
