import json

import cv2
import numpy as np
import pytest
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker

PERIOD_NS = 33_333_333


def frames_of(path, first=0, count=None):
    capture = cv2.VideoCapture(str(path))
    for index in range(first + (count or 10**6)):
        ok, image = capture.read()
        if not ok:
            return
        if index >= first:
            yield index, image


def holds(box, point):
    return box[0] <= point[0] <= box[0] + box[2] and box[1] <= point[1] <= box[1] + box[3]


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("k08_point_m100_gain80", "right"),
        ("c11_point_p60", "left"),  # a brown sleeve before a picture of an orange flower
        ("c16_point_m60_small", "right"),  # bare arms, a wooden floor below and behind
    ],
)
def test_face_and_pointing_hand_of_a_clip_are_found(rendered, name, side):
    truth = json.loads((rendered / f"{name}.json").read_text())["frames"]
    tracker = Tracker(TrackerConfig())
    faces = hands = raised = 0
    for index, image in frames_of(rendered / f"{name}.mp4", count=76):
        tracks = tracker.update(image, 1, index * PERIOD_NS)
        person = truth[index]["persons"][0]
        faces += any(t.kind == "face" and holds(person["face"]["bbox_visible"], t.centroid_px) for t in tracks)
        if person["phase"] == "stroke":
            raised += 1
            centre = np.array(person["hands"][side]["centroid_visible_px"])
            hands += any(t.kind == f"{side}_hand" and np.hypot(*(centre - t.centroid_px)) < 15 for t in tracks)
    assert faces >= 0.95 * 76
    assert raised > 10
    assert hands >= 0.9 * raised


@pytest.mark.parametrize("every", [2, 3])
def test_somebody_who_walks_past_in_profile_is_found_as_soon_at_a_lower_frame_rate(rendered, every):
    def found_at(every):
        tracker = Tracker(TrackerConfig())
        frames = frames_of(rendered / "a11_walk.mp4", count=60)
        return next(k for k, image in frames if k % every == 0 and tracker.update(image, 1, k * PERIOD_NS))

    assert found_at(every) - found_at(1) <= every


def test_an_empty_room_with_flickering_light_has_nobody_in_it(rendered):
    tracker = Tracker(TrackerConfig())
    assert not any(
        tracker.update(image, 1, k * PERIOD_NS) for k, image in frames_of(rendered / "a09_empty_flicker.mp4", count=60)
    )


@pytest.mark.parametrize("name", ["c19_point_m40_crossarm"])
def test_two_runs_on_the_same_frames_are_equal(rendered, name):
    runs = []
    for _ in range(2):
        tracker = Tracker(TrackerConfig())
        runs.append([tracker.update(image, 1, k * PERIOD_NS) for k, image in frames_of(rendered / f"{name}.mp4", count=50)])
    assert runs[0] == runs[1]
