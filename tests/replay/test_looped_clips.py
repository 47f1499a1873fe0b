"""A clip played again and again leaves no more behind than once: what a core keeps is bounded, in a run and from run to run."""

import gc
import itertools
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from deixis_evaluation.clips import load_clips
from deixis_evaluation.references import read_reference
from deixis_evaluation.replay import Given
from deixis_fusion.config import FusionConfig
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.localisation import RobotPlace
from deixis_gesture.config import GestureConfig
from deixis_gesture.recognizer import GestureRecognizer
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_runtime.lens import Lens
from deixis_schemas.messages import Gestures, HeadPoses, OfFrame, Producer, Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker

CLIP = next(clip for clip in load_clips(Path(__file__).parents[2] / "examples" / "clips") if clip.name == "small")
FRAME_NS = 33_333_333
# An object kept of each tenth frame, at 100 bytes, would be a megabyte an hour. Caches of the interpreter move by some dozens.
FRAMES_AN_OBJECT, CACHES = 10, 60

Play = Callable[[int, int], object]
"""Answers the frame of that number, as if it came for the first time, of that run."""


def given():
    stages = ("tracker", "headpose", "gesture")
    answers = [
        message for stage in stages for message in read_reference(Path(__file__).parent / "references", CLIP.name, stage)
    ]
    return Given(CLIP, answers)


class Clock:
    """Stamps as of a camera that never stops."""

    def __init__(self):
        self._stamps = itertools.count(10**18, FRAME_NS)

    def of_now(self, message: OfFrame, run: int):
        return message.model_copy(update={"run": run, "stamp_ns": next(self._stamps)})


def tracker(clip, clock) -> Play:
    core, pictures = Tracker(TrackerConfig()), list(clip.pictures())

    def play(number, run):
        frame = clock.of_now(pictures[number][0], run)
        core.update(pictures[number][1], run, frame.stamp_ns)

    return play


def headpose(clip, clock) -> Play:
    core, lens = HeadPoseEstimator(HeadposeConfig()), Lens.of(clip.camera())
    pictures, seen = list(clip.pictures()), clip.of(Tracks)

    def play(number, run):
        tracks = clock.of_now(seen[number], run)
        core.update(pictures[number][1], tracks.tracks, lens, run, tracks.stamp_ns)

    return play


def gesture(clip, clock) -> Play:
    core, lens, mount, seen = GestureRecognizer(GestureConfig()), Lens.of(clip.camera()), clip.camera().mount, clip.of(Tracks)

    def play(number, run):
        tracks = clock.of_now(seen[number], run)
        core.update(tracks.tracks, tracks.width, tracks.height, lens, run, tracks.stamp_ns, tracks.room_offset_px, mount)

    return play


def fusion(clip, clock) -> Play:
    core = Fusion(FusionConfig(), Producer("fusion", "looped"))
    core.set_pois(clip.pois())
    core.set_camera(clip.camera())
    core.start_robot_at(RobotPlace())
    parts = list(zip(clip.of(Tracks), clip.of(HeadPoses), clip.of(Gestures), strict=True))

    def play(number, run):
        tracks, poses, gestures = parts[number]
        tracks = clock.of_now(tracks, run)
        same = {"run": run, "stamp_ns": tracks.stamp_ns}
        core.answer(JoinedFrame(tracks, poses.model_copy(update=same), gestures.model_copy(update=same)), {}, None)

    return play


def objects() -> int:
    gc.collect()
    return sys.getallocatedblocks()


@pytest.mark.parametrize("runs", ["one run", "a run for each loop"])
@pytest.mark.parametrize(
    # Until all that is bounded is full (fusion's caches: 7000 frames), and then as many as the time of a test allows.
    ("stage", "warm_up", "loops"),
    [(tracker, 4, 12), (headpose, 8, 24), (gesture, 100, 200), (fusion, 150, 150)],
)
def test_a_core_keeps_no_more_of_many_loops_than_of_a_few(stage, warm_up, loops, runs):
    clip = given()
    frames = len(clip.of(Tracks))
    play = stage(clip, Clock())

    def loop(number):
        for frame in range(frames):
            play(frame, 1 if runs == "one run" else 1 + number)

    for number in range(warm_up):
        loop(number)
    before = objects()
    for number in range(warm_up, warm_up + loops):
        loop(number)
    assert objects() - before < CACHES + loops * frames / FRAMES_AN_OBJECT
