"""How often hand and head were read as what at this site, as the tables that fusion reads.

A session holds some dozens of pointings, a table hundreds of numbers: so the paper's table counts as some pointings to each
region, and what was seen is added to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from deixis_fusion.config import PaperConfig
from deixis_fusion.confusion import HandConfusion, HeadConfusion, fig_6, table_1
from deixis_fusion.pointing import GESTURES, REGIONS, PointingGesture, region_of
from numpy.typing import NDArray

BELIEVED = 5.0
"""So many pointings to each region (each intended yaw) the paper's tables count for."""
ADDED = 0.5 / 3
"""To each gesture: what was never seen among few is not impossible."""


@dataclass(frozen=True)
class Read:
    """Of one pointing: bearing_deg of the POI at the person, what the hand was read as, and the yaw of the head, if any."""

    bearing_deg: float
    gesture: PointingGesture | None
    yaw_deg: float | None


def hand_table(reads: Sequence[Read], source: str) -> HandConfusion:
    """P(gesture | region pointed to) of the pointings that were recognised."""
    paper, limits = table_1(), PaperConfig()
    reach = limits.phi_h_min_deg, limits.phi_h_max_deg
    seen = [(read.gesture, region_of(read.bearing_deg, reach)) for read in reads if read.gesture is not None]
    counts = {
        gesture: {
            region: BELIEVED * paper.share(gesture, region) + ADDED + sum(one == (gesture, region) for one in seen)
            for region in REGIONS
        }
        for gesture in GESTURES
    }
    totals = {region: sum(row[region] for row in counts.values()) for region in REGIONS}
    table = {gesture: {region: round(row[region] / totals[region], 4) for region in REGIONS} for gesture, row in counts.items()}
    return HandConfusion.model_validate({"source": source, "table": table})


def head_table(reads: Sequence[Read], source: str) -> HeadConfusion:
    """P(perceived yaw | intended yaw): a pointing between two columns counts for both, as does a yaw between two rows."""
    paper = fig_6()
    intended, perceived = np.array(paper.intended_deg), np.array(paper.perceived_deg)
    counts = BELIEVED * np.array([*paper.table, paper.not_computed])
    for read in reads:
        columns = _between(intended, abs(read.bearing_deg))
        rows = np.zeros(len(perceived) + 1)
        if read.yaw_deg is None:
            rows[-1] = 1
        else:
            # To the other side is as wrong as straight ahead is, where sizes alone are told.
            toward = read.yaw_deg if read.bearing_deg >= 0 else -read.yaw_deg
            rows[:-1] = _between(perceived, max(0.0, toward))
        counts += np.outer(rows, columns)
    shares = np.round(counts / counts.sum(axis=0), 4)
    return HeadConfusion.model_validate(
        {
            "source": source,
            "intended_deg": paper.intended_deg,
            "perceived_deg": paper.perceived_deg,
            "table": shares[:-1].tolist(),
            "not_computed": shares[-1].tolist(),
        }
    )


def _between(grid: NDArray[np.float64], value: float) -> NDArray[np.float64]:
    """A count of one, parted between the two places of a grid that a value lies between."""
    parts = np.zeros(len(grid))
    below = int(np.clip(np.searchsorted(grid, value, "right") - 1, 0, len(grid) - 2))
    share = float(np.clip((value - grid[below]) / (grid[below + 1] - grid[below]), 0, 1))
    parts[below], parts[below + 1] = 1 - share, share
    return parts
