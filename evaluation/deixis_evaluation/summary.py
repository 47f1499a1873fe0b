"""Scores of many clips put together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .blob_scores import BlobScores
from .clip_score import ClipScore, DistanceScore
from .episode_scores import OUTCOMES
from .yaw_scores import BANDS, YawBand

SIDES = ("right", "wrong", "missed")


@dataclass(frozen=True)
class Summary:
    """Aggregates. Headline: `clips_named` of `pointing_clips` (one person, each of its strokes given its one POI).

    outcomes: strokes of the single-person pointing clips by outcome. false_quiet, false_pointing: final Targets that answer
    no stroke, over quiet clips and over all others. sides: lateral strokes by right, wrong, missed.
    """

    clips: int
    failed: tuple[str, ...]
    pointing_clips: int
    clips_named: int
    outcomes: dict[str, int]
    quiet_clips: int
    quiet_clips_with_episodes: int
    false_quiet: int
    false_pointing: int
    sides: dict[str, int]
    blobs: BlobScores
    yaw: dict[str, YawBand]
    distance: DistanceScore
    frames: int
    frames_answered: int
    latency_ms: dict[str, float | None]


def summarise(scores: Iterable[ClipScore]) -> Summary:
    """Put the scores of clips together. Clips that failed are named and count as not answered, in the headline too."""
    every = list(scores)
    played = [score for score in every if score.failure is None]
    pointing = [score for score in every if score.family == "pointing"]
    quiet = [score for score in played if score.family == "quiet"]
    strokes = [item for score in every if score.family != "quiet" for item in score.answers.episodes]
    return Summary(
        clips=len(every),
        failed=tuple(score.name for score in every if score.failure is not None),
        pointing_clips=len(pointing),
        clips_named=sum(score.all_named for score in pointing),
        outcomes=_count((item.outcome for s in pointing for item in s.answers.episodes), OUTCOMES),
        quiet_clips=len(quiet),
        quiet_clips_with_episodes=sum(bool(score.answers.false_episodes) for score in quiet),
        false_quiet=sum(len(score.answers.false_episodes) for score in quiet),
        false_pointing=sum(len(score.answers.false_episodes) for score in played if score.family != "quiet"),
        sides=_count((item.side for item in strokes if item.side is not None), SIDES),
        blobs=sum((score.blobs for score in played), BlobScores()),
        yaw={name: sum((score.yaw[name] for score in played), YawBand()) for name in BANDS},
        distance=sum((score.distance for score in played), DistanceScore()),
        frames=sum(score.frames for score in every),
        frames_answered=sum(score.frames_answered for score in played),
        latency_ms=percentiles([ms for score in played for ms in score.latencies_ms]),
    )


def percentiles(latencies_ms: Iterable[float]) -> dict[str, float | None]:
    """p50 and p95; none where nothing was measured."""
    values = list(latencies_ms)
    return {f"p{q}": float(np.percentile(values, q)) if values else None for q in (50, 95)}


def _count(values: Iterable[str], names: tuple[str, ...]) -> dict[str, int]:
    counted = Counter(values)
    return {name: counted[name] for name in names}
