"""Scores of the answers: each true pointing stroke against the final Targets, and Targets that answer nothing."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from statistics import median
from typing import Literal

from deixis_schemas.messages import Gesture, HeadPose, Target

from .clips import SideName, TruePerson, Truth
from .recording import Recording
from .yaw_scores import pose_of

Outcome = Literal["named", "in_set", "missed", "wrong"]
OUTCOMES: tuple[Outcome, ...] = ("named", "in_set", "missed", "wrong")
LATERAL_FROM_DEG = 30.0
LATERAL_TO_DEG = 150.0


@dataclass(frozen=True)
class Stroke:
    """A true pointing stroke: frames `first` to `last`, both included, and what each holds of its person."""

    person_id: int
    poi: str
    first: int
    last: int
    persons: tuple[TruePerson, ...]

    @property
    def azimuth_deg(self) -> float:
        """Bearing of the POI at the person, in the middle of the stroke."""
        return median(person.poi_azimuth_deg or 0.0 for person in self.persons)

    @property
    def side(self) -> SideName | None:
        """Side that is pointed to, the person's own; none where it is hardly to tell from in front."""
        if LATERAL_FROM_DEG <= abs(self.azimuth_deg) <= LATERAL_TO_DEG:
            return "left" if self.azimuth_deg > 0 else "right"
        return None


@dataclass(frozen=True)
class EpisodeScore:
    """One true stroke: what was answered, and what head and gesture said meanwhile (to find the stage at fault).

    outcome: `named` (the one POI), `in_set` (among several), `missed` (no episode, or no POI given), `wrong`.
    side: `right`, `wrong`, or `missed` where neither side was said; none where the truth is not lateral.
    gestures: frames of the stroke by gesture said. yaw_deg, bearing_deg: medians over the stroke; none where not given.
    """

    person: int
    poi: str
    azimuth_deg: float
    frames: tuple[int, int]
    outcome: Outcome
    answered: bool
    poi_ids: tuple[str, ...]
    target_frames: tuple[float, float] | None
    conflict: float | None
    reason: str
    side: Literal["right", "wrong", "missed"] | None
    gestures: dict[str, int]
    yaw_deg: float | None
    true_yaw_deg: float
    head: dict[str, int]
    bearing_deg: float | None


@dataclass(frozen=True)
class FalseEpisode:
    """A final Target that belongs to no true stroke, or a second one to the same."""

    frames: tuple[float, float]
    poi_ids: tuple[str, ...]
    reason: str


@dataclass(frozen=True)
class EpisodeScores:
    """All strokes of a clip in order, and the Targets left over."""

    episodes: tuple[EpisodeScore, ...] = ()
    false_episodes: tuple[FalseEpisode, ...] = ()


@dataclass
class _Answers:
    """Final Targets in the clip's frames, and which of them are taken."""

    recording: Recording
    spans: list[tuple[float, float]] = field(init=False)
    taken: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        at = self.recording.frame_at
        self.spans = [(at(target.started_ns), at(target.ended_ns)) for target in self.recording.targets]

    def take(self, stroke: Stroke, tracked: set[int] | None) -> int | None:
        """Index of the Target that overlaps most with the stroke; `tracked` are the persons it may speak of, none: any."""
        best, longest = None, 0.0
        for index, (target, (first, last)) in enumerate(zip(self.recording.targets, self.spans, strict=True)):
            overlap = min(last, stroke.last) - max(first, stroke.first)
            own = tracked is None or target.person_id in tracked
            if own and index not in self.taken and overlap > longest:
                best, longest = index, overlap
        if best is not None:
            self.taken.add(best)
        return best


def strokes_of(truth: Truth) -> list[Stroke]:
    """The true pointing strokes of a clip, by their start."""
    strokes = []
    for person_id in truth.person_ids:
        run: list[tuple[int, TruePerson]] = []
        for frame in truth.frames:
            pointing = next((person for person in frame.persons if person.id == person_id and person.points), None)
            if run and (pointing is None or pointing.poi != run[-1][1].poi):
                strokes.append(_stroke(run))
                run = []
            if pointing is not None:
                run.append((frame.frame, pointing))
        if run:
            strokes.append(_stroke(run))
    return sorted(strokes, key=lambda stroke: (stroke.first, stroke.person_id))


def score_episodes(truth: Truth, recording: Recording, persons: dict[int, int]) -> EpisodeScores:
    """Match final Targets to true strokes by overlap in time, and score them.

    `persons` is the true person behind each tracked one; it decides whose answer a Target is in clips of several persons. In
    a clip of one person any Target counts.
    """
    answers = _Answers(recording)
    alone = len(truth.person_ids) == 1
    scores = []
    for stroke in strokes_of(truth):
        tracked = None if alone else {own for own, true in persons.items() if true == stroke.person_id}
        index = answers.take(stroke, tracked)
        target = None if index is None else recording.targets[index]
        span = None if index is None else answers.spans[index]
        scores.append(_score(stroke, target, span, recording, persons, tracked))
    left = [index for index in range(len(recording.targets)) if index not in answers.taken]
    false = [FalseEpisode(answers.spans[i], tuple(recording.targets[i].poi_ids), recording.targets[i].reason) for i in left]
    return EpisodeScores(tuple(scores), tuple(false))


def outcome_of(poi: str, poi_ids: tuple[str, ...]) -> Outcome:
    """What an answer is worth when `poi` was meant."""
    if not poi_ids:
        return "missed"
    if poi not in poi_ids:
        return "wrong"
    return "named" if len(poi_ids) == 1 else "in_set"


def _stroke(run: list[tuple[int, TruePerson]]) -> Stroke:
    person = run[0][1]
    return Stroke(person.id, person.poi or "", run[0][0], run[-1][0], tuple(person for _, person in run))


def _score(
    stroke: Stroke,
    target: Target | None,
    span: tuple[float, float] | None,
    recording: Recording,
    persons: dict[int, int],
    tracked: set[int] | None,
) -> EpisodeScore:
    poi_ids = tuple(target.poi_ids) if target else ()
    gestures, poses = _gestures(stroke, recording, tracked), _poses(stroke, recording, persons)
    said: Counter[str] = Counter(gesture.gesture if gesture.phase == "stroke" else gesture.phase for gesture in gestures)
    return EpisodeScore(
        person=stroke.person_id,
        poi=stroke.poi,
        azimuth_deg=stroke.azimuth_deg,
        frames=(stroke.first, stroke.last),
        outcome=outcome_of(stroke.poi, poi_ids),
        answered=target is not None,
        poi_ids=poi_ids,
        target_frames=span,
        conflict=target.conflict if target else None,
        reason=target.reason if target else "",
        side=_side(stroke, said),
        gestures=dict(sorted(said.items())),
        yaw_deg=_median([pose.yaw_deg for pose in poses if pose.yaw_deg is not None]),
        true_yaw_deg=median(person.head.yaw_rel_deg for person in stroke.persons),
        head=dict(sorted(Counter(pose.status for pose in poses).items())),
        bearing_deg=_median([gesture.bearing_deg for gesture in gestures if gesture.bearing_deg is not None]),
    )


def _gestures(stroke: Stroke, recording: Recording, tracked: set[int] | None) -> list[Gesture]:
    """What was said of the person in each frame of the stroke; of several, the one that is in a stroke."""
    said = []
    for frame in range(stroke.first, stroke.last + 1):
        own = [item for item in recording.gestures_at(frame) if tracked is None or item.person_id in tracked]
        if own:
            said.append(min(own, key=lambda item: (item.phase != "stroke", item.person_id)))
    return said


def _poses(stroke: Stroke, recording: Recording, persons: dict[int, int]) -> list[HeadPose]:
    found = [pose_of(person, recording.poses_at(stroke.first + i), persons) for i, person in enumerate(stroke.persons)]
    return [pose for pose in found if pose is not None]


def _side(stroke: Stroke, said: Counter[str]) -> Literal["right", "wrong", "missed"] | None:
    if stroke.side is None:
        return None
    left, right = said["point_left"], said["point_right"]
    if left == right:
        return "missed"
    return "right" if stroke.side == ("left" if left > right else "right") else "wrong"


def _median(values: list[float]) -> float | None:
    return median(values) if values else None
