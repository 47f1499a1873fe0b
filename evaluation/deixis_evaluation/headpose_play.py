"""Plays a clip to the cores that head pose needs, in this process: pictures to the tracker, its tracks to headpose.

No transport and no clock, so two runs are equal, and nobody else is waited for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_runtime.lens import Lens, LensError
from deixis_schemas.messages import HeadPoses, Producer
from deixis_tracker.config import TrackerConfig

from .clips import Clip, ClipError
from .head_samples import head_samples
from .headpose_scores import HeadposeScore
from .matching import true_persons
from .recording import Recording
from .replay import INSTANCE, Given, ReplayError
from .seeing import seen_by_tracker, seen_in_labels


@dataclass(frozen=True)
class HeadposeSetup:
    """Settings of the cores; `true_tracks`: the labels stand in place of the tracker."""

    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    headpose: HeadposeConfig = field(default_factory=HeadposeConfig)
    true_tracks: bool = False


def evaluate_heads(clip: Clip, setup: HeadposeSetup, on_frame: Callable[[], None] = lambda: None) -> HeadposeScore:
    """Play one clip and put its truth beside the answers; what goes wrong with it stands in the score's `failure`."""
    truth = clip.truth
    try:
        recording = play_heads(clip, setup, on_frame)
    except (ClipError, LensError, ReplayError) as error:
        return HeadposeScore(clip.name, truth.meta.kind, len(truth.frames), failure=str(error))
    # True tracks carry the labels' own ids.
    persons = {number: number for number in truth.person_ids} if setup.true_tracks else true_persons(truth, recording)
    return HeadposeScore(clip.name, truth.meta.kind, len(truth.frames), head_samples(truth, recording, persons))


def play_heads(clip: Clip, setup: HeadposeSetup, on_frame: Callable[[], None] = lambda: None) -> Recording:
    """What tracker and headpose say of each frame. Raises ClipError, LensError or ReplayError."""
    given, recording = Given(clip), Recording()
    lens, estimator = Lens.of(given.camera()), HeadPoseEstimator(setup.headpose)
    see = seen_in_labels(clip) if setup.true_tracks else seen_by_tracker(setup.tracker)
    for frame, picture in given.pictures():
        tracks = see(frame, picture)
        poses = estimator.update(picture, tracks.tracks, lens, frame.run, frame.stamp_ns)
        recording.add(tracks, frame.stamp_ns)
        recording.add(HeadPoses.derive(frame, Producer("headpose", INSTANCE), poses=poses), frame.stamp_ns)
        on_frame()
    return recording
