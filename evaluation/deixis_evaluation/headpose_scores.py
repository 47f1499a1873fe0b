"""Scores of the headpose stage alone: over all heads, and by how far they are truly turned."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from .angle_scores import AngleScore
from .head_samples import ABSENT, ANGLES, AngleName, HeadSample, angle_score
from .proportion import Proportion

HEAD_BANDS: dict[str, float] = {"0-15": 15, "15-30": 30, "30-60": 60, "60-90": 90, "90-130": 130, "beyond_130": float("inf")}
"""Name and upper limit of |true yaw|, degrees."""
STATUSES = ("tracking", "out_of_range", "initialising", "lost", ABSENT)
LARGE_ERROR_DEG = 20.0
SURE_SIGMA_DEG = 10.0
"""Who states less than this is believed: a large error is silent then."""


@dataclass(frozen=True)
class HeadScore:
    """Figures of some heads; a head in a frame counts as one frame.

    answered: status `tracking`. large, silent: of the frames answered, yaw off by more than LARGE_ERROR_DEG; silent ones stated
    a sigma below SURE_SIGMA_DEG. side_said, side_right: of all frames, a side is stated by yaw or in words; it is the true one.
    """

    frames: int
    statuses: dict[str, int]
    answered: Proportion
    large: Proportion
    silent: Proportion
    side_said: Proportion
    side_right: Proportion
    angles: dict[AngleName, AngleScore]

    @property
    def yaw(self) -> AngleScore:
        """Of the angle that fusion uses."""
        return self.angles["yaw"]


@dataclass(frozen=True)
class HeadposeScore:
    """A clip's heads. `failure`: why it was not played; then there are none. frames: of the video."""

    name: str
    kind: str
    frames: int
    samples: Sequence[HeadSample] = field(default_factory=tuple)
    failure: str | None = None


def score_heads(samples: Sequence[HeadSample]) -> HeadScore:
    """Put the figures of some heads together."""
    counted = Counter(item.status for item in samples)
    return HeadScore(
        frames=len(samples),
        statuses={status: counted[status] for status in STATUSES},
        answered=Proportion.of(item.tracked is not None for item in samples),
        large=Proportion.of(_is_large(item) for item in samples if item.tracked is not None),
        silent=Proportion.of(_is_silent(item) for item in samples if item.tracked is not None),
        side_said=Proportion.of(item.side is not None for item in samples),
        side_right=Proportion.of(item.side_is_right for item in samples),
        angles={angle: angle_score(list(samples), angle) for angle in ANGLES},
    )


def score_bands(samples: Sequence[HeadSample]) -> dict[str, HeadScore]:
    """The figures of each band of |true yaw|."""
    by_band: dict[str, list[HeadSample]] = {name: [] for name in HEAD_BANDS}
    for item in samples:
        by_band[head_band(item.true.yaw)].append(item)
    return {name: score_heads(items) for name, items in by_band.items()}


def head_band(yaw_deg: float) -> str:
    """Name of the band that a true yaw falls into."""
    return next(name for name, limit in HEAD_BANDS.items() if abs(yaw_deg) < limit)


def all_samples(scores: Iterable[HeadposeScore]) -> list[HeadSample]:
    """The heads of all clips."""
    return [item for score in scores for item in score.samples]


def _is_large(item: HeadSample) -> bool:
    return abs(item.error_deg("yaw") or 0.0) > LARGE_ERROR_DEG


def _is_silent(item: HeadSample) -> bool:
    return _is_large(item) and (item.sigma_deg("yaw") or 0.0) < SURE_SIGMA_DEG
