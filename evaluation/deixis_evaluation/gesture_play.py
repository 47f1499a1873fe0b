"""Plays a clip to the cores that gestures need, in this process: pictures to the tracker, its tracks to gesture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from deixis_gesture.config import GestureConfig
from deixis_gesture.recognizer import GestureRecognizer
from deixis_runtime.lens import Lens, LensError
from deixis_schemas.messages import Gestures, Producer
from deixis_tracker.config import TrackerConfig

from .clips import Clip, ClipError
from .gesture_scores import GestureScore, score_gestures
from .matching import true_persons
from .recording import Recording
from .replay import INSTANCE, Given, ReplayError
from .seeing import seen_by_tracker, seen_in_labels


@dataclass(frozen=True)
class GestureSetup:
    """Settings of the cores; `true_tracks`: the labels stand in place of the tracker."""

    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    gesture: GestureConfig = field(default_factory=GestureConfig)
    true_tracks: bool = False


def evaluate_gestures(clip: Clip, setup: GestureSetup, on_frame: Callable[[], None] = lambda: None) -> GestureScore:
    """Play one clip and put its truth beside the answers; what goes wrong with it stands in the score's `failure`."""
    truth = clip.truth
    try:
        recording = play_gestures(clip, setup, on_frame)
    except (ClipError, LensError, ReplayError) as error:
        return GestureScore(clip.name, truth.meta.kind, len(truth.frames) / truth.meta.fps, failure=str(error))
    # True tracks carry the labels' own ids.
    persons = {number: number for number in truth.person_ids} if setup.true_tracks else true_persons(truth, recording)
    return score_gestures(clip.name, truth, recording, persons)


def play_gestures(clip: Clip, setup: GestureSetup, on_frame: Callable[[], None] = lambda: None) -> Recording:
    """What tracker and gesture say of each frame. Raises ClipError, LensError or ReplayError."""
    given, recording, recognizer = Given(clip), Recording(), GestureRecognizer(setup.gesture)
    lens, mount = Lens.of(given.camera()), given.camera().mount
    see = seen_in_labels(clip) if setup.true_tracks else seen_by_tracker(setup.tracker)
    for frame, picture in given.pictures():
        seen = see(frame, picture)
        size, offset = (seen.width, seen.height), seen.room_offset_px
        gestures = recognizer.update(seen.tracks, *size, lens, seen.run, seen.stamp_ns, offset, mount)
        recording.add(seen, frame.stamp_ns)
        recording.add(Gestures.derive(frame, Producer("gesture", INSTANCE), gestures=gestures), frame.stamp_ns)
        on_frame()
    return recording
