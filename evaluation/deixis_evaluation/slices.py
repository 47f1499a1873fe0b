"""Where strokes fail: outcomes by what the strokes are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from .clip_score import ClipScore
from .clips import Clip
from .episode_scores import OUTCOMES
from .traits import TRAITS, Asked
from .wilson import wilson


@dataclass(frozen=True)
class Slice:
    """Outcomes of the strokes that have the value `value` of the trait `trait`."""

    trait: str
    value: str
    clips: int
    strokes: int
    outcomes: dict[str, int]

    @property
    def named_share(self) -> float:
        """Strokes that were given their one POI, by strokes."""
        return self.outcomes["named"] / self.strokes

    @property
    def named_interval(self) -> tuple[float, float]:
        """95 % interval of that share."""
        return wilson(self.outcomes["named"], self.strokes) or (0.0, 1.0)


def slices_of(clips: Sequence[Clip], scores: Sequence[ClipScore]) -> list[Slice]:
    """All slices, by trait; traits that all strokes share, or that nothing is known of, are left out.

    Strokes of clips of several persons count too. Those of clips that were not played are missed.
    """
    by_name = {clip.name: clip for clip in clips}
    asked = [Asked(by_name[score.name], stroke) for score in scores for stroke in score.answers.episodes]
    slices = []
    for trait, word_of in TRAITS.items():
        groups: dict[str, list[Asked]] = {}
        for item in asked:
            word = word_of(item)
            if word is not None:
                groups.setdefault(word, []).append(item)
        if len(groups) > 1:
            slices += [_slice(trait, value, groups[value]) for value in sorted(groups, key=_in_order)]
    return slices


def _slice(trait: str, value: str, asked: Sequence[Asked]) -> Slice:
    counted = Counter(item.stroke.outcome for item in asked)
    return Slice(
        trait=trait,
        value=value,
        clips=len({item.clip.name for item in asked}),
        strokes=len(asked),
        outcomes={name: counted[name] for name in OUTCOMES},
    )


def _in_order(value: str) -> tuple[float, str]:
    """Numbers by size, with `below` first and `above` last; words by name."""
    words = value.split()
    number = next((float(word) for word in words if word.replace(".", "", 1).isdigit()), 0.0)
    return number + {"below": -0.1, "above": 0.1}.get(words[0], 0.0), value
