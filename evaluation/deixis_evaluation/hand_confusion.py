"""The paper's table 1 as measured: which gesture is recognised, by the region pointed to. Fusion reads the file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError
from deixis_fusion.config import PaperConfig
from deixis_fusion.confusion import HandConfusion
from deixis_fusion.pointing import GESTURES, REGIONS, region_of

from .gesture_scores import StrokeScore
from .json_file import write_json

ADDED = 0.5
"""To each count (Krichevsky and Trofimov): what was never seen among a few strokes is not impossible."""


def count_gestures(strokes: Sequence[StrokeScore], range_deg: tuple[float, float]) -> dict[str, dict[str, int]]:
    """How often each gesture was recognised of strokes to each region, and how often none was (`missed`)."""
    counted: Counter[tuple[str, str]] = Counter((stroke.said, region_of(stroke.azimuth_deg, range_deg)) for stroke in strokes)
    return {said: {region: counted[said, region] for region in REGIONS} for said in (*GESTURES, "missed")}


def hand_confusion(counts: dict[str, dict[str, int]], source: str) -> HandConfusion:
    """P(gesture | region) of the strokes that were recognised. Raises CommandError where a region has none of them."""
    totals = {region: sum(counts[gesture][region] for gesture in GESTURES) for region in REGIONS}
    empty = [region for region, total in totals.items() if total == 0]
    if empty:
        raise CommandError(f"--confusion: no pointing was recognised to the {' or '.join(empty)}; score more clips")
    whole = {region: total + ADDED * len(GESTURES) for region, total in totals.items()}
    rows = {gesture: {region: (counts[gesture][region] + ADDED) / whole[region] for region in REGIONS} for gesture in GESTURES}
    return HandConfusion.model_validate({"source": source, "table": rows})


def write_confusion(path: Path, strokes: Sequence[StrokeScore], source: str) -> None:
    """Write the measured table, with the counts it was made of. Raises CommandError."""
    paper = PaperConfig()
    counts = count_gestures(strokes, (paper.phi_h_min_deg, paper.phi_h_max_deg))
    content: dict[str, Any] = hand_confusion(counts, source).model_dump()
    write_json(path, {**content, "counts": counts, "added_to_each_count": ADDED})
