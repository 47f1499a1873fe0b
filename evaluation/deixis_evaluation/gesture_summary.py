"""Figures of the gesture stage over clips: what `deixis eval --stage gesture` prints and writes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from .gesture_scores import GestureScore, StrokeScore
from .proportion import Proportion


@dataclass(frozen=True)
class GestureSummary:
    """recognised, side: of the strokes; within_68, within_95: how often the true bearing is in these regions, and
    elevation_within_1, elevation_within_2: the true elevation within 1 and 1.96 sigma. Medians: none where there was nothing.
    false_per_quiet_minute: of clips in which nobody points.
    """

    strokes: int
    recognised: Proportion
    side: Proportion
    bearing_off_deg: float | None
    within_68: Proportion
    within_95: Proportion
    elevation_off_deg: float | None
    elevation_within_1: Proportion
    elevation_within_2: Proportion
    onset_s: float | None
    end_s: float | None
    false: int
    quiet_minutes: float
    false_in_quiet: int

    @property
    def false_per_quiet_minute(self) -> float | None:
        """None where no clip is quiet."""
        return self.false_in_quiet / self.quiet_minutes if self.quiet_minutes else None


def summarise_gestures(scores: Sequence[GestureScore]) -> GestureSummary:
    """Of all clips that were played."""
    played = [score for score in scores if score.failure is None]
    strokes = [stroke for score in played for stroke in score.strokes]
    found = [stroke for stroke in strokes if stroke.said != "missed"]
    levels = [stroke.level for stroke in found if stroke.level is not None]
    high = [
        (abs(stroke.elevation_off_deg), stroke.elevation_sigma_deg)
        for stroke in found
        if stroke.elevation_off_deg is not None and stroke.elevation_sigma_deg is not None
    ]
    quiet = [score for score in played if score.is_quiet]
    return GestureSummary(
        strokes=len(strokes),
        recognised=Proportion(len(found), len(strokes)),
        side=Proportion.of(
            stroke.said == f"point_{stroke.side}" for stroke in found if stroke.side and stroke.said != "invisible"
        ),
        bearing_off_deg=_median([abs(stroke.bearing_off_deg) for stroke in found if stroke.bearing_off_deg is not None]),
        within_68=Proportion.of(level < 0.68 for level in levels),
        within_95=Proportion.of(level < 0.95 for level in levels),
        elevation_off_deg=_median([off for off, _ in high]),
        elevation_within_1=Proportion.of(off <= sigma for off, sigma in high),
        elevation_within_2=Proportion.of(off <= 1.96 * sigma for off, sigma in high),
        onset_s=_median([stroke.onset_s for stroke in strokes if stroke.onset_s is not None]),
        end_s=_median([stroke.end_s for stroke in strokes if stroke.end_s is not None]),
        false=sum(len(score.false) for score in played),
        quiet_minutes=sum(score.seconds for score in quiet) / 60,
        false_in_quiet=sum(len(score.false) for score in quiet),
    )


def figures(scores: Sequence[GestureScore]) -> dict[str, Any]:
    """What the JSON file says of clips: shares 0 to 1, null where nothing was there."""
    summary = summarise_gestures(scores)
    return {
        "strokes": summary.strokes,
        "recognised": _share(summary.recognised),
        "side": _share(summary.side),
        "bearing_off_deg": summary.bearing_off_deg,
        "bearing_within_68": _share(summary.within_68),
        "bearing_within_95": _share(summary.within_95),
        "elevation_off_deg": summary.elevation_off_deg,
        "elevation_within_1_sigma": _share(summary.elevation_within_1),
        "elevation_within_1.96_sigma": _share(summary.elevation_within_2),
        "onset_s": summary.onset_s,
        "end_s": summary.end_s,
        "false": summary.false,
        "quiet_minutes": summary.quiet_minutes,
        "false_per_quiet_minute": summary.false_per_quiet_minute,
    }


def stroke_figures(stroke: StrokeScore) -> dict[str, Any]:
    """One stroke."""
    return {
        "person": stroke.person,
        "azimuth_deg": stroke.azimuth_deg,
        "arm": stroke.arm,
        "frames": stroke.frames,
        "said": stroke.said,
        "bearing_off_deg": stroke.bearing_off_deg,
        "elevation_off_deg": stroke.elevation_off_deg,
        "elevation_sigma_deg": stroke.elevation_sigma_deg,
        "onset_s": stroke.onset_s,
        "end_s": stroke.end_s,
        "probability": stroke.probability,
    }


def _share(counted: Proportion) -> dict[str, Any]:
    interval = counted.interval
    return {
        "share": counted.share,
        "hits": counted.hits,
        "of": counted.total,
        "interval_95": None if interval is None else list(interval),
    }


def _median(values: Sequence[float]) -> float | None:
    return median(values) if values else None
