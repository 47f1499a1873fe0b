"""Plays a clip to the cores of all stages once, and then fusion again and again: on what the stages said, on the truth in place
of some of them, and with other POIs. No transport and no clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

from deixis_fusion.config import FusionConfig
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.localisation import RobotPlace
from deixis_runtime.lens import LensError
from deixis_schemas.messages import Gestures, HeadPoses, Poi, Producer, Target, Tracks

from .camera_pose import map_position, path_of
from .clips import Clip, ClipError
from .episode_scores import EpisodeScore, Outcome, Stroke, score_episodes, strokes_of
from .matching import true_persons
from .recording import Recording
from .replay import INSTANCE, REPLAYS, START_NS, Given, ReplayError
from .robot_way import RobotWay
from .true_gestures import TrueGestures
from .true_heads import TrueHeads

Variant = Literal["as they are", "true yaw", "true hand", "both true"]
VARIANTS: tuple[Variant, ...] = get_args(Variant)
GAPS_DEG = (10, 15, 22, 30)
RING_REACH_DEG = 180


@dataclass(frozen=True)
class GapAnswer:
    """What was answered of a stroke with POIs every `gap_deg` around the person. chance: that of the likeliest, as stated, and
    whether that one was meant; none where nothing was answered. `stroke` is its number in the clip. by_masses: the same of the
    POI of the largest pignistic probability, which explains and does not decide.
    """

    gap_deg: int
    outcome: Outcome
    chance: float | None
    is_meant: bool
    stroke: int = 0
    by_masses: tuple[float, bool] | None = None


@dataclass(frozen=True)
class FusionScore:
    """One clip: its strokes and how many episodes were false, by what fusion was given; and the answers among rings of POIs."""

    name: str
    kind: str
    strokes: dict[Variant, tuple[EpisodeScore, ...]] = field(default_factory=dict)
    false: dict[Variant, int] = field(default_factory=dict)
    gaps: tuple[GapAnswer, ...] = ()
    failure: str | None = None


@dataclass(frozen=True)
class _Heard:
    """What the stages said of a clip, frame by frame, and the same of the truth."""

    tracks: Sequence[Tracks]
    poses: Sequence[HeadPoses]
    gestures: Sequence[Gestures]
    true_poses: Sequence[HeadPoses]
    true_gestures: Sequence[Gestures]

    def frames(self, variant: Variant) -> Iterator[JoinedFrame]:
        poses = self.true_poses if variant in ("true yaw", "both true") else self.poses
        gestures = self.true_gestures if variant in ("true hand", "both true") else self.gestures
        for frame in zip(self.tracks, poses, gestures, strict=True):
            yield JoinedFrame(*frame)


def evaluate_fusion(clip: Clip, config: FusionConfig, on_frame: Callable[[], None] = lambda: None) -> FusionScore:
    """Play one clip; what goes wrong with it stands in the score's `failure`."""
    try:
        heard = _heard(Given(clip))
        played = {variant: _play(clip, config, heard, variant) for variant in VARIANTS}
        gaps = tuple(_among_rings(clip, config, heard))
    except (ClipError, LensError, ReplayError) as error:
        return FusionScore(clip.name, clip.truth.meta.kind, failure=str(error))
    finally:
        for _ in clip.truth.frames:
            on_frame()
    scores = {variant: _scored(clip, recording) for variant, recording in played.items()}
    return FusionScore(
        clip.name,
        clip.truth.meta.kind,
        {variant: episodes for variant, (episodes, _) in scores.items()},
        {variant: false for variant, (_, false) in scores.items()},
        gaps,
    )


def _heard(given: Given) -> _Heard:
    tracks = list(REPLAYS["tracker"](given))
    poses = REPLAYS["headpose"](Given(given.clip, tracks))
    gestures = REPLAYS["gesture"](Given(given.clip, tracks))
    heads, hands = TrueHeads(given.clip.truth), TrueGestures(given.clip.truth)
    own = Given(given.clip, [*tracks, *poses, *gestures])
    seen = own.of(Tracks)
    truth = Given(given.clip, [message for track in seen for message in (*heads.hear(track), *hands.hear(track))])
    return _Heard(seen, own.of(HeadPoses), own.of(Gestures), truth.of(HeadPoses), truth.of(Gestures))


def _play(clip: Clip, config: FusionConfig, heard: _Heard, variant: Variant, pois: Sequence[Poi] | None = None) -> Recording:
    given, recording = Given(clip), Recording()
    fusion = Fusion(config, Producer("fusion", INSTANCE))
    fusion.set_pois(given.pois() if pois is None else pois)
    fusion.set_camera(given.camera())
    fusion.start_robot_at(RobotPlace())
    way = RobotWay(path_of(clip.truth), clip.truth.meta.fps, lockstep=True)
    for frame in heard.frames(variant):
        for pose in way.ahead_of(frame.source.seq, frame.source.stamp_ns):
            fusion.hear_robot(pose)
        belief, targets = fusion.answer(frame, {}, None)
        for message in (frame.tracks, frame.poses, frame.gestures, *targets, belief):
            if message is not None:
                recording.add(message, START_NS)
    for target in fusion.end(None):
        recording.add(target, START_NS)
    return recording


def _scored(clip: Clip, recording: Recording) -> tuple[tuple[EpisodeScore, ...], int]:
    scores = score_episodes(clip.truth, recording, true_persons(clip.truth, recording))
    return scores.episodes, len(scores.false_episodes)


# --- other POIs -----------------------------------------------------------------------------------------------------------


def _among_rings(clip: Clip, config: FusionConfig, heard: _Heard) -> Iterator[GapAnswer]:
    """Of a camera that stands: where one moves, persons are known from its foot of then, and POIs in the map."""
    if clip.truth.moves:
        return
    for index, stroke in enumerate(strokes_of(clip.truth)):
        for gap in GAPS_DEG:
            recording = _play(clip, config, heard, "as they are", ring_of(clip, stroke, gap))
            episode = _scored(clip, recording)[0][index]
            yield _answer(recording, episode, index, gap)


def ring_of(clip: Clip, stroke: Stroke, gap_deg: int) -> list[Poi]:
    """The POI that is meant, and others every `gap_deg` around the person, as far away and as high."""
    meta = clip.truth.meta
    xyz = next(poi.xyz_world for poi in meta.pois if poi.id == stroke.poi)
    x, y, z = map_position(meta.camera, xyz)
    at_x, at_y = stroke.persons[len(stroke.persons) // 2].user_pos.robot_xy
    around = RING_REACH_DEG // gap_deg
    pois = []
    for step in range(-around, around + 1):
        if abs(step) * gap_deg > RING_REACH_DEG - gap_deg / 2 and step < 0:
            continue  # behind, the ring closes: no two of it nearer than the gap
        turn = math.radians(step * gap_deg)
        dx, dy = x - at_x, y - at_y
        place = at_x + dx * math.cos(turn) - dy * math.sin(turn), at_y + dx * math.sin(turn) + dy * math.cos(turn)
        pois.append(Poi(poi_id=stroke.poi if step == 0 else f"ring{step}", position_m=(*place, z)))
    return pois


def _answer(recording: Recording, episode: EpisodeScore, stroke: int, gap: int) -> GapAnswer:
    target = _target_of(recording, episode)
    ranked = sorted(target.pois, key=lambda poi: -(poi.probability or 0.0)) if target else []
    if not ranked or ranked[0].probability is None:
        return GapAnswer(gap, episode.outcome, None, False, stroke)
    first = max(ranked, key=lambda poi: poi.pignistic)
    by_masses = first.pignistic, first.poi_id == episode.poi
    return GapAnswer(gap, episode.outcome, ranked[0].probability, ranked[0].poi_id == episode.poi, stroke, by_masses)


def _target_of(recording: Recording, episode: EpisodeScore) -> Target | None:
    if episode.target_frames is None:
        return None
    spans = [(recording.frame_at(target.started_ns), recording.frame_at(target.ended_ns)) for target in recording.targets]
    return next((target for target, span in zip(recording.targets, spans, strict=True) if span == episode.target_frames), None)
