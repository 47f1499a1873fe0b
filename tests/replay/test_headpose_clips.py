"""Head yaw on labelled clips, with face tracks made from the truth: as wide as the contract says, a few pixels off."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_runtime.lens import Lens
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import FrontalFace, HeadPose, KindProbabilities, Track

FOCAL_PX = 560.0
LENS = Lens(640, 480, (FOCAL_PX, FOCAL_PX, 319.5, 239.5))
SEEN_FROM_THE_FRONT_DEG = 15


def face_track(person: dict, noise: np.ndarray) -> Track:
    x, y = np.array(person["head"]["center_px"]) + noise
    width = FOCAL_PX * FACE_WIDTH_M / person["head"]["center_cam"][2]
    from_the_front = abs(person["head"]["yaw_rel_deg"]) < SEEN_FROM_THE_FRONT_DEG
    frontal = FrontalFace(centre_px=person["head"]["center_px"], width_px=width) if from_the_front else None
    return Track(
        track_id=0,
        person_id=0,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(x, y),
        bbox_px=(x - width / 2, y - width / 2, width, 1.2 * width),
        velocity_px_s=(0, 0),
        frontal=frontal,
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
        poses = estimator.update(image, [face_track(person, generator.normal(size=2))], LENS, 1, k * 33_333_333)
        answers.append((person["head"]["yaw_rel_deg"], poses[0]))
    return answers


@pytest.mark.parametrize(("name", "within_deg"), [("c11_point_p60", 6), ("c05_point_m45", 6)])
def test_the_yaw_follows_a_fast_turn_toward_a_poi(rendered: Path, name: str, within_deg: float) -> None:
    answers = replay(rendered, name, 62)
    assert sum(pose.status == "tracking" for _, pose in answers) > 60
    errors = [abs(pose.yaw_deg - truth) for truth, pose in answers if pose.yaw_deg is not None]
    turned = [abs(pose.yaw_deg - truth) for truth, pose in answers[50:] if pose.yaw_deg is not None]
    assert np.mean(errors) < 4
    assert np.mean(turned) < within_deg


def test_a_head_turned_far_away_is_read_as_far_or_out_of_range_on_its_side(rendered: Path) -> None:
    far = [pose for truth, pose in replay(rendered, "c14_point_p130", 56) if truth > 110]
    assert len(far) > 5
    assert all((pose.yaw_deg or 0) > 90 or (pose.status, pose.side) == ("out_of_range", "left") for pose in far)


def test_a_walker_who_never_faces_the_camera_is_read_all_the_way(rendered: Path) -> None:
    answers = replay(rendered, "g01_walk_rl", 60)
    errors = [abs(pose.yaw_deg - truth) for truth, pose in answers if pose.yaw_deg is not None]
    assert len(errors) > 0.85 * len(answers)  # at first its head is not in the picture
    assert np.mean(errors) < 12


def test_two_runs_give_equal_answers(rendered: Path) -> None:
    assert replay(rendered, "c11_point_p60", 45) == replay(rendered, "c11_point_p60", 45)
