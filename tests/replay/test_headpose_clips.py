"""Head yaw on labelled clips, with face tracks made from the truth: as wide as the contract says, a few pixels off."""

import json
from collections.abc import Iterator
from itertools import islice
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
SEEN_FROM_THE_FRONT_DEG = 15


def face_track(person: dict, noise: np.ndarray, times: float = 1.0, number: int = 0) -> Track:
    """The track of a face in a picture that was made so many times larger."""
    x, y = times * (np.array(person["head"]["center_px"]) + noise)
    width = times * FOCAL_PX * FACE_WIDTH_M / person["head"]["center_cam"][2]
    from_the_front = abs(person["head"]["yaw_rel_deg"]) < SEEN_FROM_THE_FRONT_DEG
    frontal = FrontalFace(centre_px=(x, y), width_px=width) if from_the_front else None
    return Track(
        track_id=number,
        person_id=number,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(x, y),
        bbox_px=(x - width / 2, y - width / 2, width, 1.2 * width),
        velocity_px_s=(0, 0),
        frontal=frontal,
    )


def frames_of(folder: Path, name: str) -> Iterator[tuple[np.ndarray, dict]]:
    """Pictures, and the one person's labels."""
    video = cv2.VideoCapture(str(folder / f"{name}.mp4"))
    for record in json.loads((folder / f"{name}.json").read_text())["frames"]:
        yield video.read()[1], record["persons"][0]


def replay(
    folder: Path, name: str, frames: int, *, times: float = 1.0, every: int = 1, fps: float = 30.0
) -> list[tuple[float, HeadPose]]:
    """Truth of the yaw and the answer, per frame; of pictures so many times larger, or of some of the frames."""
    estimator = HeadPoseEstimator(HeadposeConfig())
    lens = Lens(round(640 * times), round(480 * times), (times * FOCAL_PX, times * FOCAL_PX, times * 320, times * 240))
    generator = np.random.default_rng(5)
    answers = []
    for k, (image, person) in enumerate(islice(frames_of(folder, name), 0, frames, every)):
        picture = image if times == 1 else cv2.resize(image, (lens.width, lens.height), interpolation=cv2.INTER_AREA)
        track = face_track(person, generator.normal(size=2), times)
        poses = estimator.update(picture, [track], lens, 1, round(k * 1e9 / fps))
        answers.append((person["head"]["yaw_rel_deg"], poses[0]))
    return answers


def errors_deg(answers: list[tuple[float, HeadPose]]) -> list[float]:
    return [abs(pose.yaw_deg - truth) for truth, pose in answers if pose.yaw_deg is not None]


@pytest.mark.parametrize(("name", "within_deg"), [("c11_point_p60", 6), ("c05_point_m45", 6)])
def test_the_yaw_follows_a_fast_turn_toward_a_poi(rendered: Path, name: str, within_deg: float) -> None:
    answers = replay(rendered, name, 62)
    assert sum(pose.status == "tracking" for _, pose in answers) > 60
    assert np.mean(errors_deg(answers)) < 4
    assert np.mean(errors_deg(answers[50:])) < within_deg


def test_a_head_turned_far_away_is_read_as_far_or_out_of_range_on_its_side(rendered: Path) -> None:
    far = [pose for truth, pose in replay(rendered, "c14_point_p130", 56) if truth > 110]
    assert len(far) > 5
    assert all((pose.yaw_deg or 0) > 90 or (pose.status, pose.side) == ("out_of_range", "left") for pose in far)


def test_a_walker_who_never_faces_the_camera_is_read_all_the_way(rendered: Path) -> None:
    answers = replay(rendered, "g01_walk_rl", 60)
    errors = errors_deg(answers)
    assert len(errors) > 0.85 * len(answers)  # at first its head is not in the picture
    assert np.mean(errors) < 12


def test_two_runs_give_equal_answers(rendered: Path) -> None:
    assert replay(rendered, "c11_point_p60", 45) == replay(rendered, "c11_point_p60", 45)


@pytest.mark.parametrize("face_px", [20, 60, 300])
def test_faces_of_20_to_300_px_are_read_alike(clips: Path, face_px: int) -> None:
    _, person = next(frames_of(clips, "head_turn"))
    times = face_px * person["head"]["center_cam"][2] / (FOCAL_PX * FACE_WIDTH_M)
    answers = replay(clips, "head_turn", 60, times=times, every=2, fps=15)
    assert len(errors_deg(answers)) == len(answers)
    assert np.mean(errors_deg(answers)) < 5


@pytest.mark.parametrize(("every", "fps"), [(3, 10.0), (1, 30.0), (1, 60.0), (3, 30.0)])
def test_a_turn_is_read_at_any_rate_of_frames_and_three_times_as_fast(clips: Path, every: int, fps: float) -> None:
    """Of every third frame at the full rate a head turns by 14 degrees from frame to frame."""
    answers = replay(clips, "head_turn", 120, every=every, fps=fps)
    assert len(errors_deg(answers)) > 0.97 * len(answers)
    assert np.mean(errors_deg(answers)) < 4


def test_six_people_are_read_as_each_alone(clips: Path) -> None:
    """The same turn six times in one picture, each at another moment; by a lens so long that place turns nobody."""
    frames, focal_px = list(frames_of(clips, "head_turn")), 20 * FOCAL_PX
    together = HeadPoseEstimator(HeadposeConfig(max_persons=6))
    alone = [HeadPoseEstimator(HeadposeConfig()) for _ in range(6)]
    for k in range(20):
        shown = [frames[2 * k + 15 * number] for number in range(6)]
        pictures = [image for image, _ in shown]
        places = [np.array([640 * (number % 3), 480 * (number // 3)]) for number in range(6)]
        tracks = [face_track(shown[number][1], places[number], number=number) for number in range(6)]
        mosaic = np.vstack([np.hstack(pictures[:3]), np.hstack(pictures[3:])])
        lens = Lens(1920, 960, (focal_px, focal_px, 960, 480))
        poses = {pose.person_id: pose for pose in together.update(mosaic, tracks, lens, 1, k * 66_666_667)}
        assert len(poses) == 6
        for number, (image, person) in enumerate(shown):
            lens, track = Lens(640, 480, (focal_px, focal_px, 320, 240)), face_track(person, np.zeros(2))
            own = alone[number].update(image, [track], lens, 1, k * 66_666_667)[0]
            assert poses[number].yaw_deg == pytest.approx(own.yaw_deg, abs=3)
