"""The JSON file of `deixis eval --stage headpose`. Its keys are documented here and stay:

`machine`, `stage`, `folder`, `seeds` (A:B, or null), `plain` (whether their scenes are), `truth` (stages that the truth stood
for), `settings` (given by `--set`), `definitions` (sentences), `summary` and `clips.NAME`.
* `summary`: `clips`, `failed` (names), `frames` (of the videos) and the heads' figures.
* `clips.NAME`: `kind`, `failure`, `frames` and the heads' figures.
* The heads' figures: `heads` over all, and `bands.BAND` by |true yaw|. Each has `frames` (a head in a frame), `status`
  (counts), `answered`, `large_errors`, `silent_errors`, `side_said`, `side_right`, and `yaw`, `pitch`, `roll`.
* An angle: `frames` in which it is stated and its truth known, `mae_deg`, `bias_deg`, `median_deg`, `p90_deg` (of the absolute
  error), `sigma_median_deg`, and `within_1_sigma`, `within_1_96_sigma` of the frames that state a sigma.
* Every share is `share` (0 to 1, null where nothing was there to measure), `hits`, `of`, `interval_95` (Wilson).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .angle_scores import MOST_SIGMA, ONE_SIGMA, AngleScore
from .head_samples import HeadSample
from .headpose_scores import (
    LARGE_ERROR_DEG,
    SURE_SIGMA_DEG,
    HeadposeScore,
    HeadScore,
    all_samples,
    score_bands,
    score_heads,
)
from .machine import Machine
from .proportion import Proportion

DEFINITIONS = (
    "A head in the picture counts as one frame in each frame. Yaw is scored against yaw_rel_deg, pitch and roll against R_cam "
    "relative to the line from head to camera. Errors and coverage are those of frames answered, that is of status tracking.",
    f"A large error is a yaw off by more than {LARGE_ERROR_DEG:g} degrees; it is silent where the stated sigma is below "
    f"{SURE_SIGMA_DEG:g} degrees. Both are shares of the frames answered. Side right: the sign of the yaw tracked, or the side "
    "said where out of range, is that of the true yaw; a share of all frames.",
    "Coverage: share of errors within 1 and 1.96 of the stated sigma; 68 % and 95 % are right, less is overconfident.",
    "Intervals are 95 % (Wilson) as if frames were independent. Frames of one clip are not, so the truth is wider.",
)


@dataclass(frozen=True)
class HeadposeConditions:
    """What was played and how: `truth` the stages that the truth stood for, `settings` those that were changed, `plain`: scenes
    without difficulties.
    """

    folder: Path
    seeds: str | None = None
    truth: tuple[str, ...] = ()
    settings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    plain: bool = False


def headpose_report(conditions: HeadposeConditions, scores: Sequence[HeadposeScore], machine: Machine) -> dict[str, Any]:
    """The content of the JSON file."""
    return {
        "machine": machine,
        "stage": "headpose",
        "folder": str(conditions.folder),
        "seeds": conditions.seeds,
        "plain": conditions.plain,
        "truth": list(conditions.truth),
        "settings": {stage: list(values) for stage, values in conditions.settings.items()},
        "definitions": list(DEFINITIONS),
        "summary": {
            "clips": len(scores),
            "failed": [score.name for score in scores if score.failure is not None],
            "frames": sum(score.frames for score in scores),
            **_figures(all_samples(scores)),
        },
        "clips": {score.name: _clip(score) for score in scores},
    }


def _clip(score: HeadposeScore) -> dict[str, Any]:
    return {"kind": score.kind, "failure": score.failure, "frames": score.frames, **_figures(score.samples)}


def _figures(samples: Sequence[HeadSample]) -> dict[str, Any]:
    bands = {name: _heads(band) for name, band in score_bands(samples).items()}
    return {"heads": _heads(score_heads(samples)), "bands": bands}


def _heads(score: HeadScore) -> dict[str, Any]:
    return {
        "frames": score.frames,
        "status": score.statuses,
        "answered": _share(score.answered),
        "large_errors": _share(score.large),
        "silent_errors": _share(score.silent),
        "side_said": _share(score.side_said),
        "side_right": _share(score.side_right),
        **{name: _angle(angle) for name, angle in score.angles.items()},
    }


def _angle(angle: AngleScore) -> dict[str, Any]:
    return {
        "frames": angle.frames,
        "mae_deg": angle.mae_deg,
        "bias_deg": angle.bias_deg,
        "median_deg": angle.percentile_deg(50),
        "p90_deg": angle.percentile_deg(90),
        "sigma_median_deg": angle.sigma_median_deg,
        "within_1_sigma": _share(angle.within(ONE_SIGMA)),
        "within_1_96_sigma": _share(angle.within(MOST_SIGMA)),
    }


def _share(counted: Proportion) -> dict[str, Any]:
    interval = counted.interval
    return {
        "share": counted.share,
        "hits": counted.hits,
        "of": counted.total,
        "interval_95": None if interval is None else list(interval),
    }
