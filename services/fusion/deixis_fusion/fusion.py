"""The core: one Belief for each joined frame, and the Targets of pointing episodes. Times come as arguments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from deixis_schemas.messages import (
    MAX_PERSONS,
    Belief,
    CameraInfo,
    Gesture,
    HeadPose,
    OfFrame,
    PersonBelief,
    Poi,
    Producer,
    Target,
)

from .config import FusionConfig
from .discernment import Candidate, candidates
from .episodes import Stroke
from .joining import JoinedFrame
from .judgement import Judgement, judge
from .localisation import RobotPlace
from .person import Person, Published
from .reason import explain
from .report import evidence, poi_beliefs, unplaced
from .stroke import Sample
from .visibility import Wall
from .witnesses import SourceView, StageStatus, Witnesses, in_frame, in_stroke, views_of

# An update is worth sending when the best POI's pignistic probability has changed by this.
NOTABLE_CHANGE = 0.05


@dataclass(frozen=True)
class _Moment:
    """The frame that is being answered, and the time; `now_ns` is none where time stands still."""

    source: OfFrame
    views: Mapping[str, SourceView]
    now_ns: int | None


@dataclass(frozen=True)
class _Assessment:
    """What is thought about one person: who said what, which POIs come into question, and what follows."""

    witnesses: Witnesses
    seen: list[Candidate]
    judgement: Judgement | None

    @property
    def poi_ids(self) -> tuple[str, ...]:
        """The answer."""
        return tuple(self.seen[i].poi.poi_id for i in self.judgement.choice.hypotheses) if self.judgement else ()

    @property
    def best(self) -> float:
        """Largest pignistic probability."""
        return max(self.judgement.combination.belief.pignistic()) if self.judgement else 0.0

    @property
    def conflict(self) -> float:
        """Conflict mass 1 - K."""
        return self.judgement.combination.conflict if self.judgement else 0.0


class Fusion:
    """Follows persons from frame to frame.

    The answer to a frame depends on the frames before it and on what was set; not on a clock.
    """

    def __init__(self, config: FusionConfig, producer: Producer) -> None:
        self._config = config
        self._producer = producer
        self._pois: list[Poi] = []
        self._walls: list[Wall] = []
        self._camera: CameraInfo | None = None
        self._robot = RobotPlace()
        self._persons: dict[int, Person] = {}
        self._moment: _Moment | None = None

    def set_pois(self, pois: Sequence[Poi]) -> None:
        """The POIs that may be meant from now on."""
        self._pois = list(pois)

    def set_walls(self, walls: Sequence[Wall]) -> None:
        """What nobody sees through: segments in the map frame, metres."""
        self._walls = list(walls)

    def set_camera(self, info: CameraInfo) -> None:
        """How the camera projects, and where it is mounted."""
        self._camera = info

    def set_robot(self, place: RobotPlace) -> None:
        """Where the robot stands."""
        self._robot = place

    def open_episodes(self) -> list[str]:
        """Ids of the pointing episodes in progress."""
        return [p.episodes.open_episode.episode_id for p in self._persons.values() if p.episodes.open_episode is not None]

    def answer(
        self, frame: JoinedFrame, statuses: Mapping[str, StageStatus], now_ns: int | None
    ) -> tuple[Belief, list[Target]]:
        """Answer one frame, and say what it changed in the pointing episodes.

        `statuses` speaks for the stages that are missing in the frame. `now_ns` is Unix time, or none in lockstep, where ages
        and latencies are 0.
        """
        moment = _Moment(frame.source, views_of(frame, statuses), now_ns)
        self._moment = moment
        poses = {pose.person_id: pose for pose in frame.poses.poses} if frame.poses else {}
        gestures = {gesture.person_id: gesture for gesture in frame.gestures.gestures} if frame.gestures else {}
        present = _present(frame, poses, gestures)
        beliefs, targets = [], []
        for person_id in present:
            person = self._persons.setdefault(person_id, Person(person_id, self._config))
            person.seen_ns = moment.source.stamp_ns
            if frame.tracks is not None:
                person.see(frame.tracks, poses.get(person_id), self._camera, self._robot)
            belief, told = self._follow(person, Sample(person.seen_ns, gestures.get(person_id), poses.get(person_id)), moment)
            beliefs.append(belief)
            targets += told
        targets += self._miss(set(self._persons) - set(present), moment)
        return Belief.derive(moment.source, self._producer, persons=beliefs, missing=list(frame.missing)), targets

    def end(self, now_ns: int | None) -> list[Target]:
        """The source has ended or starts anew: final answers of all open episodes. Persons are forgotten."""
        targets = []
        if self._moment is not None:
            moment = _Moment(self._moment.source, self._moment.views, now_ns)
            targets = [t for person in self._persons.values() for t in self._final(person, person.episodes.finish(), moment)]
        self._persons = {}
        return targets

    def _follow(self, person: Person, sample: Sample, moment: _Moment) -> tuple[PersonBelief, list[Target]]:
        targets = self._final(person, person.episodes.observe(sample), moment)
        stroke = person.episodes.stroke
        if stroke is None:
            assessment = self._assess(person, in_frame(sample, moment.views))
        else:
            assessment = self._assess(person, in_stroke(stroke.samples, sample, moment.views, self._config))
        if stroke is not None and stroke.is_open and self._is_news(person, assessment, moment):
            targets.append(self._target(person, stroke, assessment, moment, final=False))
        return self._belief(person, assessment, moment), targets

    def _assess(self, person: Person, witnesses: Witnesses) -> _Assessment:
        place, config = person.place, self._config
        seen = candidates(place, self._pois, self._walls, config.wall_clearance_m) if place else []
        return _Assessment(witnesses, seen, judge(seen, witnesses.hand, witnesses.head, config) if seen else None)

    def _miss(self, absent: set[int], moment: _Moment) -> list[Target]:
        """Persons that this frame does not show: their strokes go on for the length of a drop-out only."""
        targets: list[Target] = []
        stamp_ns = moment.source.stamp_ns
        for person_id in sorted(absent):
            person = self._persons[person_id]
            targets += self._final(person, person.episodes.observe(Sample(stamp_ns, None, None)), moment)
            if stamp_ns - person.seen_ns > self._config.hold_position_s * 1e9 and person.episodes.stroke is None:
                del self._persons[person_id]
        return targets

    def _final(self, person: Person, ended: Stroke | None, moment: _Moment) -> list[Target]:
        if ended is None:
            return []
        person.published = None
        latest = Sample(moment.source.stamp_ns, None, None)
        assessment = self._assess(person, in_stroke(ended.samples, latest, moment.views, self._config))
        return [self._target(person, ended, assessment, moment, final=True)]

    def _is_news(self, person: Person, assessment: _Assessment, moment: _Moment) -> bool:
        """Whether an update is due; takes note of it."""
        last = person.published
        if last is not None:
            too_soon = moment.source.stamp_ns - last.stamp_ns < self._config.update_every_s * 1e9
            same = assessment.poi_ids == last.poi_ids and abs(assessment.best - last.best) < NOTABLE_CHANGE
            if too_soon or same:
                return False
        person.published = Published(moment.source.stamp_ns, assessment.poi_ids, assessment.best)
        return True

    def _belief(self, person: Person, assessment: _Assessment, moment: _Moment) -> PersonBelief:
        place, episode, judgement = person.place, person.episodes.open_episode, assessment.judgement
        return PersonBelief(
            person_id=person.person_id,
            position_m=place.position_m if place else None,
            distance_m=place.distance_m if place else None,
            pois=poi_beliefs(judgement, assessment.seen) if judgement else unplaced(self._pois if place is None else []),
            unknown=judgement.combination.belief.unknown if judgement else 1.0,
            conflict=assessment.conflict,
            evidence=evidence(assessment.witnesses, judgement, assessment.seen, moment.now_ns),
            episode_id=episode.episode_id if episode else None,
        )

    def _target(self, person: Person, stroke: Stroke, assessment: _Assessment, moment: _Moment, *, final: bool) -> Target:
        judgement, seen = assessment.judgement, assessment.seen
        rows = poi_beliefs(judgement, seen) if judgement else []
        return Target.derive(
            moment.source,
            self._producer,
            episode_id=stroke.episode_id,
            person_id=person.person_id,
            final=final,
            poi_ids=list(assessment.poi_ids),
            pois=sorted(rows, key=lambda row: (-row.pignistic, row.poi_id)),
            conflict=assessment.conflict,
            evidence=evidence(assessment.witnesses, judgement, seen, moment.now_ns),
            reason=explain(judgement, seen, assessment.witnesses, person.place is not None),
            started_ns=stroke.started_ns,
            ended_ns=stroke.last_pointing_ns,
            latency_ms=0.0 if moment.now_ns is None else max(0.0, (moment.now_ns - moment.source.stamp_ns) / 1e6),
        )


def _present(frame: JoinedFrame, poses: Mapping[int, HeadPose], gestures: Mapping[int, Gesture]) -> list[int]:
    """The persons in this frame; where the tracks were lost on the way, those of whom the others speak."""
    if frame.tracks is not None:
        found = {track.person_id for track in frame.tracks.tracks if track.person_id is not None}
    else:
        found = set(poses) | set(gestures)
    return sorted(found)[:MAX_PERSONS]
