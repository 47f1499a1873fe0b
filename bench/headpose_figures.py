"""Figures of head pose methods: against labels, against a referee, and by the order of labels that are only rough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from statistics import median

from deixis_evaluation.clips import Point, Truth
from deixis_evaluation.yaw_scores import LARGE_ERROR_DEG, angle_error_deg
from headpose_methods import Said

BANDS = {"0-30": (0.0, 30.0), "30-60": (30.0, 60.0), "60-90": (60.0, 90.0), "90-130": (90.0, 130.0)}
"""Name and limits of |true yaw|, degrees."""
SURE_DEG = 10.0
"""An answer with a smaller sigma is believed by fusion; a method that tells none always says it is sure."""
SAME_HEAD_WIDTHS = 0.75
"""An answer speaks of a head when its box's middle is this near to the head's, face widths."""
REFEREED_DEG = 45.0
"""Farther out the referee itself is off."""
INTERVALS = {68: 1.0, 95: 1.96}
"""Share of a normal distribution, per cent, within so many sigma."""
Figures = dict[str, float | None]


@dataclass
class Band:
    """Frames of heads that are turned so far; of those answered the errors, and how far they were read too far out, degrees."""

    frames: int = 0
    errors_deg: list[float] = field(default_factory=list)
    outward_deg: list[float] = field(default_factory=list)

    def count(self, true_deg: float, said: Said | None) -> None:
        """One head in one frame."""
        self.frames += 1
        if said is not None:
            off = (said.yaw_deg - true_deg + 180) % 360 - 180
            self.errors_deg.append(abs(off))
            self.outward_deg.append(math.copysign(1.0, true_deg) * off)


@dataclass
class Labels:
    """Score against labels. silent: answers called sure that are far off."""

    bands: dict[str, Band] = field(default_factory=lambda: {name: Band() for name in BANDS})
    answered: int = 0
    silent: int = 0

    def count(self, true_deg: float, said: Said | None) -> None:
        """One head in one frame."""
        if said is not None:
            self.answered += 1
            wrong = angle_error_deg(said.yaw_deg, true_deg) > LARGE_ERROR_DEG
            self.silent += wrong and (said.sigma_deg is None or said.sigma_deg < SURE_DEG)
        band = next((self.bands[name] for name, (low, high) in BANDS.items() if low <= abs(true_deg) < high), None)
        if band is not None:
            band.count(true_deg, said)

    def figures(self) -> Figures:
        """By band: mean error, mean of how far outward it is, share answered. Share of silent errors among the answers."""
        made: Figures = {}
        for name, band in self.bands.items():
            made[f"error_deg_{name}"] = mean(band.errors_deg)
            made[f"outward_deg_{name}"] = mean(band.outward_deg)
            made[f"answered_share_{name}"] = len(band.errors_deg) / band.frames if band.frames else None
        made["silent_share"] = self.silent / self.answered if self.answered else None
        return made


def score_clip(labels: Labels, truth: Truth, frames: Sequence[list[Said]]) -> None:
    """Count the heads of a clip that lie in the picture."""
    for frame, said in zip(truth.frames, frames, strict=False):
        for person in frame.persons:
            if truth.in_picture(person.head.center_px):
                reach = SAME_HEAD_WIDTHS * truth.face_width_px(person)
                labels.count(person.head.yaw_rel_deg, nearest(said, person.head.center_px, reach))


def nearest(said: Sequence[Said], point: Point, reach_px: float) -> Said | None:
    """The answer whose box has its middle nearest to a point, within reach."""
    best = min(said, key=lambda one: math.dist(middle_of(one), point), default=None)
    return best if best is not None and math.dist(middle_of(best), point) <= reach_px else None


def middle_of(said: Said) -> Point:
    """Middle of the box that an answer speaks of."""
    x, y, w, h = said.box_px
    return x + w / 2, y + h / 2


# --- against a referee ----------------------------------------------------------------------------------------------------


def agreement(frames: Sequence[list[Said]], referee: Sequence[list[Said]]) -> Figures:
    """One clip of one person against the referee's largest face.

    difference_deg: median, where the referee sees less than REFEREED_DEG. offset_deg, rest_deg: its constant part, which comes
    of how the head was begun, and the median of what is left. within_N_share: of these, of the intervals meant to hold N per
    cent.
    """
    pairs: list[tuple[Said, float]] = []
    asked = answered = 0
    for said, judged in zip(frames, referee, strict=True):
        if not judged:
            continue
        asked += 1
        own = nearest(said, middle_of(judged[0]), judged[0].box_px[2])
        if own is not None:
            answered += 1
            if abs(judged[0].yaw_deg) < REFEREED_DEG:
                pairs.append((own, (own.yaw_deg - judged[0].yaw_deg + 180) % 360 - 180))
    offset = median(off for _, off in pairs) if pairs else None
    made: Figures = {
        "difference_deg": median(abs(off) for _, off in pairs) if pairs else None,
        "offset_deg": None if offset is None else abs(offset),
        "rest_deg": None if offset is None else median(abs(off - offset) for _, off in pairs),
        "answered_share": answered / asked if asked else None,
    }
    return made | {f"within_{percent}_share": coverage(pairs, width) for percent, width in INTERVALS.items()}


def coverage(pairs: Sequence[tuple[Said, float]], width: float) -> float | None:
    """Share of signed errors (degrees) within `width` sigma of their answers; none where no answer has a sigma."""
    held = [abs(error) <= width * said.sigma_deg for said, error in pairs if said.sigma_deg is not None]
    return sum(held) / len(held) if held else None


# --- against labels in steps ----------------------------------------------------------------------------------------------


def ordered_share(pairs: Sequence[tuple[float, float]]) -> tuple[int, int]:
    """How many pairs of differently labelled pictures have their yaws in the labels' order, and how many there are.

    pairs: (label, yaw) of one person, degrees.
    """
    told = [(one, other) for one, other in combinations(pairs, 2) if one[0] != other[0]]
    return sum((one[0] < other[0]) == (one[1] < other[1]) and one[1] != other[1] for one, other in told), len(told)


def steps(drivers: Sequence[Sequence[tuple[float, float | None]]]) -> Figures:
    """Figures of labels in coarse steps. drivers: of each person (label, yaw or none where not answered), degrees."""
    answered = [[(label, yaw) for label, yaw in pairs if yaw is not None] for pairs in drivers]
    every = [pair for pairs in answered for pair in pairs]
    turned = [(label, yaw) for label, yaw in every if label != 0]
    counts = [ordered_share(pairs) for pairs in answered]
    pictures, told = sum(len(pairs) for pairs in drivers), sum(count for _, count in counts)
    return {
        "answered_share": len(every) / pictures if pictures else None,
        "ordered_share": sum(right for right, _ in counts) / told if told else None,
        "sign_share": sum(label * yaw > 0 for label, yaw in turned) / len(turned) if turned else None,
        "error_deg": mean([angle_error_deg(yaw, label) for label, yaw in every]),
    }


def mean(values: Sequence[float]) -> float | None:
    """The mean, none of nothing."""
    return sum(values) / len(values) if values else None
