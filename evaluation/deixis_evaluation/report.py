"""The JSON file of `deixis eval`. Its keys are documented here and stay:

`machine`, `lockstep`, `folder`, `seeds` (A:B, or null), `plain` (whether their scenes are), `truth` (stages that the truth
stood for), `definitions` (sentences), `summary`, `slices` and `clips.NAME`; shares are 0 to 1, and null where
nothing was there to measure.
* `summary` and `clips.NAME`: `failure` (a clip) or `failed` (names), `frames`, `frames_answered`, `latency_ms.p50|p95`,
  `face_recall`, `raised_hand_recall`, `hand_recall`, `false_hands_per_frame`, `distance_error_percent`, and
  `yaw.BAND` with `frames`, `tracking_share`, `mae_deg`, `large_error_share` (of tracked frames, above 20 degrees),
  `out_of_range_share`, `said_or_side_share`, `silent_error_share` (of all frames).
* `summary`: `poi_named_share` (clips of one person who points, each stroke given its one POI), `pointing_clips`,
  `clips_named`, `outcomes.named|in_set|missed|wrong` (strokes), `quiet_clips`, `quiet_clips_with_episodes`,
  `false_episodes_quiet`, `false_episodes_pointing`, `sides.right|wrong|missed`.
* `slices`: a list of `trait`, `value`, `clips`, `strokes`, `named`, `in_set`, `missed`, `wrong`, `named_share` and
  `named_interval_95` (Wilson); traits in which the strokes do not differ are left out.
* `clips.NAME`: `kind`, `family`, `episodes` (fields of episode_scores.EpisodeScore), `false_episodes` (of FalseEpisode).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .blob_scores import BlobScores
from .clip_score import ClipScore, DistanceScore
from .machine import Machine
from .matching import DEFINITION
from .slices import Slice
from .summary import Summary, percentiles
from .yaw_scores import YawBand

YAW_DEFINITION = (
    "Yaw is scored against yaw_rel_deg; heads outside the picture are left out. The error is that of frames with status "
    "tracking. A silent error is a yaw that is tracked and wrong by more than 20 degrees."
)
EPISODE_DEFINITION = (
    "A final Target answers the true stroke of its person that it overlaps most in time; what is left over, or speaks of "
    "nobody's stroke, is a false episode. A clip counts as named when each of its strokes is given its one POI."
)


@dataclass(frozen=True)
class Conditions:
    """What was played and how: `seeds` of the simulator as A:B, `truth` the stages that the truth stood for, `plain` scenes."""

    folder: Path
    lockstep: bool
    seeds: str | None = None
    truth: tuple[str, ...] = ()
    plain: bool = False


def report(
    conditions: Conditions, scores: Sequence[ClipScore], summary: Summary, slices: Sequence[Slice], machine: Machine
) -> dict[str, Any]:
    """The content of the JSON file."""
    return {
        "machine": machine,
        "lockstep": conditions.lockstep,
        "folder": str(conditions.folder),
        "seeds": conditions.seeds,
        "plain": conditions.plain,
        "truth": list(conditions.truth),
        "definitions": [EPISODE_DEFINITION, DEFINITION, YAW_DEFINITION],
        "summary": _summary(summary),
        "slices": [_slice(item) for item in slices],
        "clips": {score.name: _clip(score) for score in scores},
    }


def _summary(summary: Summary) -> dict[str, Any]:
    return {
        "poi_named_share": summary.clips_named / summary.pointing_clips if summary.pointing_clips else None,
        "pointing_clips": summary.pointing_clips,
        "clips_named": summary.clips_named,
        "outcomes": summary.outcomes,
        "quiet_clips": summary.quiet_clips,
        "quiet_clips_with_episodes": summary.quiet_clips_with_episodes,
        "false_episodes_quiet": summary.false_quiet,
        "false_episodes_pointing": summary.false_pointing,
        "sides": summary.sides,
        "clips": summary.clips,
        "failed": list(summary.failed),
        "frames": summary.frames,
        "frames_answered": summary.frames_answered,
        "latency_ms": summary.latency_ms,
        **_perception(summary.blobs, summary.yaw, summary.distance),
    }


def _slice(item: Slice) -> dict[str, Any]:
    return {
        "trait": item.trait,
        "value": item.value,
        "clips": item.clips,
        "strokes": item.strokes,
        **item.outcomes,
        "named_share": item.named_share,
        "named_interval_95": list(item.named_interval),
    }


def _clip(score: ClipScore) -> dict[str, Any]:
    return {
        "kind": score.kind,
        "family": score.family,
        "failure": score.failure,
        "episodes": [asdict(item) for item in score.answers.episodes],
        "false_episodes": [asdict(item) for item in score.answers.false_episodes],
        "frames": score.frames,
        "frames_answered": score.frames_answered,
        "latency_ms": percentiles(score.latencies_ms),
        **_perception(score.blobs, score.yaw, score.distance),
    }


def _perception(blobs: BlobScores, yaw: dict[str, YawBand], distance: DistanceScore) -> dict[str, Any]:
    return {
        "face_recall": blobs.faces.share,
        "raised_hand_recall": blobs.raised_hands.share,
        "hand_recall": blobs.hands.share,
        "false_hands_per_frame": blobs.false_hands_per_frame,
        "distance_error_percent": distance.error_percent,
        "yaw": {name: _band(band) for name, band in yaw.items()},
    }


def _band(band: YawBand) -> dict[str, Any]:
    return {
        "frames": band.frames,
        "tracking_share": band.share(band.tracking),
        "mae_deg": band.mae_deg,
        "large_error_share": band.large_error_share,
        "out_of_range_share": band.share(band.out_of_range),
        "said_or_side_share": band.share(band.said_or_side),
        "silent_error_share": band.share(band.silent),
    }
