from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from deixis_schemas.messages import Frame, Producer
from deixis_tracker import service
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker


class OneFrameNode:
    """Stands for a Node that hands over one frame and notes what the stage says."""

    producer = Producer("tracker", "test")

    def __init__(self, height, width):
        image = np.zeros((height, width, 3), np.uint8)
        self.frame = Frame(
            run=1,
            seq=0,
            stamp_ns=1,
            stage="camera",
            instance="test",
            width=width,
            height=height,
            encoding="bgr8",
            data=image.tobytes(),
        )
        self.counted, self.notes, self.warned, self.answers, self._turns = {}, {}, {}, [], 1

    def subscribe(self, _topic):
        return SimpleNamespace(take=lambda: self.frame, key="deixis/r1/camera/frame")

    def publish(self, _topic):
        return SimpleNamespace(put=self.answers.append)

    def wait(self):
        self._turns -= 1
        return self._turns >= 0

    def step(self):
        return nullcontext()

    def count(self, name, n=1):
        self.counted[name] = n

    def note(self, key, text):
        self.notes[key] = text

    def warn(self, kind, text):
        self.warned[kind] = text


def test_a_frame_that_is_too_small_is_counted_named_by_its_key_and_answered_without_tracks():
    node = OneFrameNode(16, 16)
    service.serve(node, TrackerConfig())
    assert node.counted == {"frames_refused": 1}
    assert node.warned["frame"].startswith("deixis/r1/camera/frame: frame 0 of camera/test refused: ")
    assert [answer.tracks for answer in node.answers] == [[]]


def test_a_fault_of_the_core_is_not_taken_for_one_of_the_frame(monkeypatch):
    def faulty(*_):
        raise ValueError("attempt to get argmax of an empty sequence")

    monkeypatch.setattr(Tracker, "update", faulty)
    with pytest.raises(ValueError, match="argmax"):
        service.serve(OneFrameNode(64, 64), TrackerConfig())


def test_a_camera_that_moves_is_noted_in_health_and_how_far_is_said_with_the_tracks(monkeypatch):
    def turned(tracker, *_):
        tracker.camera_moves, tracker.room_offset_px = True, (-12.0, 3.0)
        return []

    monkeypatch.setattr(Tracker, "update", turned)
    monkeypatch.setattr(Tracker, "left_out", 0)
    node = OneFrameNode(64, 64)
    service.serve(node, TrackerConfig())
    assert "camera moves" in node.notes["camera"]
    assert node.answers[0].room_offset_px == (-12.0, 3.0)


def test_persons_left_out_are_counted_in_health(monkeypatch):
    monkeypatch.setattr(Tracker, "update", lambda *_: [])
    monkeypatch.setattr(Tracker, "left_out", 2)
    node = OneFrameNode(64, 64)
    service.serve(node, TrackerConfig())
    assert node.counted == {"persons_left_out": 2}
