"""Pointing episodes: from a stroke to its one final answer.

An episode opens when a pointing stroke has lasted long enough, goes on through short drop-outs, and ends when the hand is
withdrawn, the person is lost or the source ends. Durations are counted in the time of `RunClock` (`Sample.at_ns`).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from .config import EpisodesConfig
from .evidence import Sample
from .frames import FrameLog

FORGOTTEN_EVERY_S = 0.5


@dataclass
class Stroke:
    """One stroke of one person; an episode once it `is_open`. `first` and `last` are its first and last pointing frames."""

    first: Sample
    last: Sample
    held_ns: int
    episode_id: str = ""
    samples: FrameLog = field(default_factory=FrameLog)
    not_pointing: int = 0
    sides: Counter[str] = field(default_factory=Counter)

    @property
    def is_open(self) -> bool:
        """Whether it has lasted long enough to be an episode."""
        return bool(self.episode_id)


class EpisodeTracker:
    """Follows the strokes of one person, frame by frame."""

    def __init__(self, person_id: int, config: EpisodesConfig) -> None:
        self._person_id = person_id
        self._config = config
        self._count = 0
        self._turn: list[Sample] = []
        self.stroke: Stroke | None = None

    @property
    def open_episode(self) -> Stroke | None:
        """The stroke in progress, where it is an episode."""
        return self.stroke if self.stroke is not None and self.stroke.is_open else None

    def observe(self, sample: Sample) -> Stroke | None:
        """Take in the next frame. Returns the episode that it ended, for its final answer."""
        ended = self._end_after_gap(sample.at_ns) or self._end_after_turn(sample)
        if sample.unclear and self.stroke is not None:
            # A hand still held up whose outline tells nothing for a while is the same gesture.
            self.stroke.held_ns = sample.at_ns
        if sample.pointing:
            self._extend(sample)
        elif sample.not_pointing and self.stroke is not None:
            self.stroke.not_pointing += 1
        self._open_if_long_enough()
        return ended

    def finish(self) -> Stroke | None:
        """End whatever goes on. Returns the episode that it ended, for its final answer."""
        episode = self.open_episode
        self.stroke, self._turn = None, []
        return episode

    def _end_after_gap(self, now_ns: int) -> Stroke | None:
        if self.stroke is None:
            return None
        gone = now_ns - self.stroke.held_ns > self._config.max_gap_s * 1e9
        unclear = now_ns - self.stroke.last.at_ns > self._config.max_unclear_s * 1e9
        return self.finish() if gone or unclear else None

    def _end_after_turn(self, sample: Sample) -> Stroke | None:
        """A hand that swings over to the other side and stays there begins another episode, without a retraction between."""
        if self.stroke is None or not _opposes(sample, self.stroke):
            if sample.pointing and sample.pointing != "invisible":
                self._turn = []
            return None
        self._turn.append(sample)
        if sample.at_ns - self._turn[0].at_ns < self._config.swing_s * 1e9:
            return None
        turn = self._turn[:-1]
        ended = self.open_episode
        if ended is not None:
            before = [old for old in ended.samples if old.at_ns < turn[0].at_ns]
            ended.samples = FrameLog(before or [ended.first])
            ended.last = ended.samples[-1]
        self.stroke, self._turn = None, []
        for old in turn:
            self._extend(old)
        return ended

    def _extend(self, sample: Sample) -> None:
        if self.stroke is None:
            self.stroke = Stroke(sample, sample, sample.at_ns)
        self.stroke.last, self.stroke.held_ns = sample, sample.at_ns
        self.stroke.samples.append(sample)
        self.stroke.sides[sample.pointing or ""] += 1
        oldest_ns = sample.at_ns - self._config.max_evidence_s * 1e9
        # Now and then: where the person was at first is where the views of a walk begin (`views.py`).
        if self.stroke.samples[0].at_ns < oldest_ns - FORGOTTEN_EVERY_S * 1e9:
            self.stroke.samples = self.stroke.samples.since(oldest_ns)

    def _open_if_long_enough(self) -> None:
        stroke = self.stroke
        if stroke is None or stroke.is_open:
            return
        lasted_ns = stroke.last.at_ns - stroke.first.at_ns
        if lasted_ns < self._config.min_stroke_s * 1e9 or stroke.not_pointing >= len(stroke.samples):
            return
        self._count += 1
        stroke.episode_id = f"p{self._person_id}-{stroke.first.stamp_ns}-{self._count}"


def _opposes(sample: Sample, stroke: Stroke) -> bool:
    """Whether the sample points to the side opposite to what the stroke has shown so far."""
    if sample.pointing not in ("point_left", "point_right"):
        return False
    other = "point_right" if sample.pointing == "point_left" else "point_left"
    return stroke.sides[other] > stroke.sides[sample.pointing]
