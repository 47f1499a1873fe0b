"""All scores of one clip: truth and recording in, figures out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from .blob_scores import BlobScores, score_blobs
from .clips import Truth
from .episode_scores import EpisodeScores, score_episodes
from .matching import true_persons
from .recording import Recording
from .yaw_scores import BANDS, YawBand, score_yaw

Family = Literal["pointing", "quiet", "several"]


@dataclass(frozen=True)
class DistanceScore:
    """Sum of relative errors of the distance camera - person, and of how many frames."""

    frames: int = 0
    sum_relative_error: float = 0.0

    def __add__(self, other: DistanceScore) -> DistanceScore:
        return DistanceScore(self.frames + other.frames, self.sum_relative_error + other.sum_relative_error)

    @property
    def error_percent(self) -> float | None:
        """Mean relative error, percent."""
        return 100 * self.sum_relative_error / self.frames if self.frames else None


@dataclass(frozen=True)
class ClipScore:
    """Scores of a clip. `failure`: why it was not played or scored; then the rest is empty.

    family: `pointing` (one person who points), `quiet` (nobody points), `several` (someone points among several persons).
    latencies_ms: in lockstep from receipt of a frame to receipt of its belief, else from capture to receipt of the belief.
    """

    name: str
    kind: str
    family: Family
    frames: int
    failure: str | None = None
    frames_answered: int = 0
    answers: EpisodeScores = field(default_factory=EpisodeScores)
    blobs: BlobScores = field(default_factory=BlobScores)
    yaw: dict[str, YawBand] = field(default_factory=lambda: dict.fromkeys(BANDS, YawBand()))
    distance: DistanceScore = field(default_factory=DistanceScore)
    latencies_ms: tuple[float, ...] = ()

    @property
    def all_named(self) -> bool:
        """Whether each stroke of the clip got its one POI."""
        return bool(self.answers.episodes) and all(item.outcome == "named" for item in self.answers.episodes)


def family_of(truth: Truth) -> Family:
    """What a clip is counted among."""
    if not any(person.points for frame in truth.frames for person in frame.persons):
        return "quiet"
    return "pointing" if len(truth.person_ids) == 1 else "several"


def score_clip(name: str, truth: Truth, recording: Recording, *, lockstep: bool) -> ClipScore:
    """Score what the system said about a clip."""
    persons = true_persons(truth, recording)
    return ClipScore(
        name=name,
        kind=truth.meta.kind,
        family=family_of(truth),
        frames=len(truth.frames),
        frames_answered=sum(frame.frame in recording.beliefs for frame in truth.frames),
        answers=score_episodes(truth, recording, persons),
        blobs=score_blobs(truth, recording),
        yaw=score_yaw(truth, recording, persons),
        distance=score_distance(truth, recording, persons),
        latencies_ms=latencies_ms(recording, lockstep=lockstep),
    )


def failed_clip(name: str, truth: Truth, failure: str) -> ClipScore:
    """The score of a clip that could not be played: nothing was answered."""
    return replace(score_clip(name, truth, Recording(), lockstep=True), failure=failure)


def score_distance(truth: Truth, recording: Recording, persons: dict[int, int]) -> DistanceScore:
    """Compare fusion's distance of each person with the true one, in all frames where it gives one."""
    score = DistanceScore()
    for frame in truth.frames:
        belief = recording.beliefs.get(frame.frame)
        true_m = {person.id: person.user_pos.distance_m for person in frame.persons}
        for person in belief.persons if belief else ():
            expected_m = true_m.get(persons.get(person.person_id, -1))
            if expected_m is not None and person.distance_m is not None:
                score += DistanceScore(1, abs(person.distance_m - expected_m) / expected_m)
    return score


def latencies_ms(recording: Recording, *, lockstep: bool) -> tuple[float, ...]:
    """Time to each frame's belief; stamps of lockstep are media time, so there the frame's receipt is the start."""
    starts = recording.frame_ns if lockstep else recording.stamps_ns
    return tuple((end - starts[seq]) / 1e6 for seq, end in sorted(recording.belief_ns.items()) if seq in starts)
