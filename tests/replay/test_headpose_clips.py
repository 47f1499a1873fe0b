"""Head yaw on labelled clips, with face boxes made from the truth: about as wide as the face, a few pixels off."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_schemas.messages import HeadPose, KindProbabilities, Track


def face_track(person: dict, noise: np.ndarray) -> Track:
    x, y = np.array(person["head"]["center_px"]) + noise
    width = 95 / person["head"]["center_cam"][2]
    return Track(
        track_id=0,
        person_id=0,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(x, y),
        bbox_px=(x - width / 2, y - width / 2, width, 1.2 * width),
        velocity_px_s=(0, 0),
    )


def replay(folder: Path, name: str, frames: int) -> list[tuple[float, HeadPose]]:
    """Truth of the yaw and the answer, per frame."""
    truth = json.loads((folder / f"{name}.json").read_text())["frames"][:frames]
    video = cv2.VideoCapture(str(folder / f"{name}.mp4"))
    estimator = HeadPoseEstimator(HeadposeConfig())
    generator = np.random.default_rng(5)
    answers = []
    for k, record in enumerate(truth):
        image = video.read()[1]
        person = record["persons"][0]
        poses = estimator.update(image, [face_track(person, generator.normal(size=2))], k * 33_333_333)
        answers.append((person["head"]["yaw_rel_deg"], poses[0]))
    return answers


@pytest.mark.parametrize("name", ["c11_point_p60", "c05_point_m45"])
def test_the_yaw_follows_a_fast_turn_toward_a_poi(rendered: Path, name: str) -> None:
    answers = replay(rendered, name, 62)
    assert sum(pose.status == "tracking" for _, pose in answers) > 55
    errors = [abs(pose.yaw_deg - truth) for truth, pose in answers if pose.yaw_deg is not None]
    turned = [abs(pose.yaw_deg - truth) for truth, pose in answers[50:] if pose.yaw_deg is not None]
    assert np.mean(errors) < 5
    assert np.mean(turned) < 12


def test_a_head_turned_far_away_is_out_of_range_on_its_side(rendered: Path) -> None:
    far = [pose for truth, pose in replay(rendered, "c14_point_p130", 56) if truth > 110]
    assert len(far) > 5
    assert all((pose.status, pose.side) == ("out_of_range", "left") for pose in far)


def test_two_runs_give_equal_answers(rendered: Path) -> None:
    assert replay(rendered, "c11_point_p60", 45) == replay(rendered, "c11_point_p60", 45)
