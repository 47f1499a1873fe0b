"""The core: one Belief for each joined frame, and the Targets of pointing episodes. Times come as arguments."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from deixis_runtime.lens import LensError
from deixis_schemas.messages import (
    MAX_PERSONS,
    Belief,
    CameraInfo,
    Gesture,
    HeadPose,
    OfFrame,
    Poi,
    Producer,
    RobotPose,
    Target,
)
from deixis_schemas.runs import RunClock

from .assessment import NONE, Assessment
from .caution import Caution
from .config import FusionConfig
from .decision import ByMasses, Rules
from .deixis_rules import DeixisRules
from .episodes import EpisodeTracker, Stroke
from .evidence import Evidence, Sample, Witness
from .gathering import StageStatus, gather, stages_of
from .joining import JoinedFrame
from .localisation import Camera, PersonLocator, RobotPlace, face_of
from .paper_rules import PaperRules
from .paper_sight import seen_by_both
from .report import PersonReport, Rows, TargetReport
from .robot_path import RobotFix, RobotPath
from .sight import Lookout, Points
from .views import last_place
from .visibility import Wall, Walls

# An update is worth sending when the best POI's probability has changed by this.
NOTABLE_CHANGE = 0.05
KEPT_TARGETS = 16


class _Moment(NamedTuple):
    """The frame that is being answered and its time by `RunClock`; `now_ns` is Unix time, none where it stands still."""

    frame: OfFrame
    at_ns: int
    stages: Mapping[str, Witness]
    robot: RobotFix
    now_ns: int | None


@dataclass
class _Published:
    """What was last published of an open episode: to send updates on change only, at a bounded rate."""

    at_ns: int
    poi_ids: tuple[str, ...]
    best: float


class _Person:
    """State of one person between frames."""

    def __init__(self, person_id: int, config: FusionConfig) -> None:
        self.person_id = person_id
        self.locator = PersonLocator(config.place)
        self.episodes = EpisodeTracker(person_id, config.episodes)
        self.published: _Published | None = None
        self.caution = Caution()
        self.lookout = Lookout(config.place.wall_clearance_m)
        self.seen_ns = 0


def rules_of(config: FusionConfig) -> Rules:
    """The rules by their setting."""
    if config.rules == "paper":
        return ByMasses(PaperRules(config.paper, config.confusion), config.answer.credible)
    return DeixisRules(config.hand, config.head, config.answer, config.confusion.hand)


class Fusion:
    """Follows persons from frame to frame.

    The answer to a frame depends on the frames of its run before it and on what was set; not on a clock. `persons` is the
    standing of each in the last frame, `recent` are the last final answers. `clock_uncertain_ns`: by how much the times given
    as `now_ns` may be off the clock of the frames' stamps; none where that is not known.
    """

    def __init__(self, config: FusionConfig, producer: Producer) -> None:
        self._config = config
        self._producer = producer
        self._rules = rules_of(config)
        self._rows = Rows(config.answer.rows)
        self._points = Points.of(())
        self._walls = Walls(())
        self._camera: Camera | None = None
        self._clock = RunClock()
        self._followed: dict[int, _Person] = {}
        self._moment: _Moment | None = None
        self.robot = RobotPath(config.place.robot_pose_max_age_s)
        self.clock_uncertain_ns: int | None = None
        self.persons: list[PersonReport] = []
        self.recent: deque[TargetReport] = deque(maxlen=KEPT_TARGETS)

    def set_pois(self, pois: Sequence[Poi]) -> None:
        """The POIs that may be meant from now on."""
        self._points = Points.of(sorted(pois, key=lambda poi: poi.poi_id))

    def set_walls(self, walls: Sequence[Wall]) -> None:
        """What nobody sees through: segments in the map frame, metres."""
        self._walls = Walls(walls)

    def set_camera(self, info: CameraInfo) -> str | None:
        """How the camera projects, and where it is mounted. Returns why persons cannot be placed, if so."""
        try:
            self._camera = Camera.of(info)
        except LensError as error:
            self._camera = None
            return str(error)
        return None

    def start_robot_at(self, place: RobotPlace) -> None:
        """Where the robot stands until it says otherwise."""
        self.robot.start_at(place)

    def hear_robot(self, pose: RobotPose) -> None:
        """The robot says where it is."""
        self.robot.hear(pose)

    @property
    def robot_doubt(self) -> str:
        """Why the robot may have stood elsewhere at the last frame; empty where nothing speaks against it."""
        return self._moment.robot.doubt if self._moment else ""

    def open_episodes(self) -> list[str]:
        """Ids of the pointing episodes in progress."""
        episodes = (person.episodes.open_episode for person in self._followed.values())
        return [episode.episode_id for episode in episodes if episode is not None]

    def answer(
        self, frame: JoinedFrame, statuses: Mapping[str, StageStatus], now_ns: int | None
    ) -> tuple[Belief, list[Target]]:
        """Answer one frame, and say what it changed in the pointing episodes.

        The first frame of a run ends the episodes of the last one; its persons are forgotten. `statuses` speaks for the
        stages that are missing in the frame. `now_ns` is Unix time, or none in lockstep, where ages and latencies are 0.
        """
        source = frame.source
        new_run, at_ns, _ = self._clock.advance(source.run, source.stamp_ns)
        targets = self.end(now_ns) if new_run else []
        moment = _Moment(source, at_ns, stages_of(frame, statuses), self.robot.at(source.stamp_ns), now_ns)
        self._moment = moment
        poses = {pose.person_id: pose for pose in frame.poses.poses} if frame.poses else {}
        gestures = {gesture.person_id: gesture for gesture in frame.gestures.gestures} if frame.gestures else {}
        present = _present(frame, poses, gestures)
        self.persons = []
        for person_id in present:
            person = self._followed.setdefault(person_id, _Person(person_id, self._config))
            person.seen_ns = at_ns
            self._see(person, frame, poses.get(person_id), moment)
            sample = Sample(at_ns, source.stamp_ns, gestures.get(person_id), poses.get(person_id), person.locator.place)
            targets += self._follow(person, sample, moment)
        targets += self._miss(set(self._followed) - set(present), moment)
        beliefs = [report.message(self._rows) for report in self.persons]
        return Belief.derive(source, self._producer, persons=beliefs, missing=list(frame.missing)), targets

    def end(self, now_ns: int | None) -> list[Target]:
        """The source has ended or starts anew: final answers of all open episodes. Persons are forgotten."""
        targets = []
        if self._moment is not None:
            for person in self._followed.values():
                targets += self._final(person, person.episodes.finish(), self._moment, now_ns)
        self._followed, self.persons = {}, []
        return targets

    def _see(self, person: _Person, frame: JoinedFrame, pose: HeadPose | None, moment: _Moment) -> None:
        if frame.tracks is None:
            return
        face, size = face_of(frame.tracks, person.person_id), (frame.tracks.width, frame.tracks.height)
        person.locator.see(face, size, pose, (self._camera, moment.robot.place), moment.at_ns)

    def _follow(self, person: _Person, sample: Sample, moment: _Moment) -> list[Target]:
        """Take in a frame that shows the person."""
        targets = self._final(person, person.episodes.observe(sample), moment, moment.now_ns)
        stroke, episode = person.episodes.stroke, person.episodes.open_episode
        evidence = gather(stroke.samples if stroke else (), sample, moment.stages, self._config.episodes)
        if stroke is None:
            person.caution.forget()
        assessment = self._assess(person, evidence, moment, stroke)
        if episode is not None and self._is_news(person, assessment, moment):
            targets.append(self._tell(person, episode, assessment, moment, moment.now_ns))
        episode_id = episode.episode_id if episode else None
        self.persons.append(PersonReport(person.person_id, assessment, episode_id, moment.now_ns))
        return targets

    def _miss(self, absent: set[int], moment: _Moment) -> list[Target]:
        """Persons that this frame does not show: their strokes go on for the length of a drop-out only."""
        targets: list[Target] = []
        for person_id in sorted(absent):
            person = self._followed[person_id]
            nothing = Sample(moment.at_ns, moment.frame.stamp_ns, None, None)
            targets += self._final(person, person.episodes.observe(nothing), moment, moment.now_ns)
            if moment.at_ns - person.seen_ns > self._config.place.hold_s * 1e9 and person.episodes.stroke is None:
                del self._followed[person_id]
        return targets

    def _assess(self, person: _Person, evidence: Evidence, moment: _Moment, stroke: Stroke | None) -> Assessment:
        """What is thought of the person, seen from where a stroke was last seen: who points and walks off means the same."""
        place, judgement = (last_place(stroke.samples) if stroke else None) or person.locator.place, None
        hidden = robot_blind = NONE
        if place is not None:
            seen, hidden = person.lookout.look(place, self._points, self._walls), person.lookout.hidden
            if self._config.rules == "paper":
                by_person = seen
                seen = seen_by_both(by_person, place, self._walls, self._config.place.wall_clearance_m)
                robot_blind = np.setdiff1d(by_person.chosen, seen.chosen)
            judgement = self._rules.judge(seen, evidence) if len(seen) else None
        if judgement is not None:
            judgement = person.caution.judged(judgement, evidence)
        return Assessment(place, evidence, judgement, self._points.pois, moment.robot.doubt, hidden, robot_blind)

    def _final(self, person: _Person, ended: Stroke | None, moment: _Moment, now_ns: int | None) -> list[Target]:
        if ended is None:
            return []
        person.published = None
        latest = Sample(moment.at_ns, moment.frame.stamp_ns, None, None)
        evidence = gather(ended.samples, latest, moment.stages, self._config.episodes)
        return [self._tell(person, ended, self._assess(person, evidence, moment, ended), moment, now_ns, final=True)]

    def _is_news(self, person: _Person, assessment: Assessment, moment: _Moment) -> bool:
        """Whether an update is due; takes note of it."""
        last = person.published
        if last is not None:
            too_soon = moment.at_ns - last.at_ns < self._config.answer.update_every_s * 1e9
            same = assessment.poi_ids == last.poi_ids and abs(assessment.best - last.best) < NOTABLE_CHANGE
            if too_soon or same:
                return False
        person.published = _Published(moment.at_ns, assessment.poi_ids, assessment.best)
        return True

    def _tell(
        self, person: _Person, stroke: Stroke, assessment: Assessment, moment: _Moment, now_ns: int | None, final: bool = False
    ) -> Target:
        report = TargetReport(
            frame=OfFrame.derive(moment.frame, self._producer),
            person_id=person.person_id,
            episode_id=stroke.episode_id,
            started_ns=stroke.first.stamp_ns,
            ended_ns=stroke.last.stamp_ns,
            final=final,
            assessment=assessment,
            now_ns=now_ns,
            uncertain_ns=self.clock_uncertain_ns,
        )
        if final:
            self.recent.append(report)
        return report.message(self._rows)


def _present(frame: JoinedFrame, poses: Mapping[int, HeadPose], gestures: Mapping[int, Gesture]) -> list[int]:
    """The persons in this frame; where the tracks were lost on the way, those of whom the others speak."""
    if frame.tracks is not None:
        found = {track.person_id for track in frame.tracks.tracks if track.person_id is not None}
    else:
        found = set(poses) | set(gestures)
    return sorted(found)[:MAX_PERSONS]
