"""The truth in place of stages: pure answers to frames and tracks that are made up here."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from deixis_camera.pacing import LOCKSTEP_EPOCH_NS
from deixis_evaluation.camera_pose import FootPose
from deixis_evaluation.clips import Clip, Truth
from deixis_evaluation.replay import START_NS
from deixis_evaluation.robot_way import AHEAD, RobotWay
from deixis_evaluation.stand_ins import read_stages, say_blind, speakers_for
from deixis_evaluation.true_gestures import TrueGestures
from deixis_evaluation.true_heads import TrueHeads
from deixis_evaluation.true_tracks import TrueTracks
from deixis_fusion.localisation import RobotPlace
from deixis_fusion.robot_path import RobotPath
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import Frame, Gestures, HeadPoses, RobotPose, Tracks
from labelled_views import STANDING

FRAME_NS = 33_333_333


def person(number: int = 0, x: float = 320.0, **changes: Any) -> dict[str, Any]:
    def hand(at: float) -> dict[str, Any]:
        return {"center_px": [at, 350], "centroid_visible_px": [at, 350], "visible_px": 400, "in_frame": True}

    return {
        "id": number,
        "phase": "none",
        "gesture": "none",
        "head": {"yaw_rel_deg": 0.0, "center_px": [x, 200], "center_cam": [0.1, 0.2, 2.0]},
        "face": {"bbox_visible": [x - 20, 175, 40, 50], "centroid_visible_px": [x, 200], "visible_px": 900},
        "hands": {"left": hand(x + 70), "right": hand(x - 70)},
        "user_pos": {"robot_xy": [2, 0], "distance_m": 2.0},
    } | changes


def points(azimuth_deg: float, eye_tip_deg: float | None = None) -> dict[str, Any]:
    arm = {"side": "left", "eye_tip_azimuth_deg": eye_tip_deg}
    return {"phase": "stroke", "gesture": "point", "poi": "P1", "poi_azimuth_deg": azimuth_deg, "arm": arm}


def turned(yaw_deg: float) -> dict[str, Any]:
    return {"head": {"yaw_rel_deg": yaw_deg, "center_px": [320, 200]}}


def truth(*persons: dict[str, Any], frames: int = 3) -> Truth:
    meta = {
        "kind": "point",
        "fps": 30,
        "width": 640,
        "height": 480,
        "camera": STANDING,
        "pois": [{"id": "P1", "xyz_world": [1, 1, 0]}],
    }
    shown = [{"frame": index, "persons": list(persons)} for index in range(frames)]
    return Truth.model_validate({"meta": meta, "frames": shown})


def of_frame(seq: int, stage: str) -> dict[str, Any]:
    return {"run": 1, "seq": seq, "stamp_ns": START_NS + seq * FRAME_NS, "stage": stage, "instance": "t"}


def tracks(*faces: tuple[int, float], seq: int = 0) -> Tracks:
    """Face tracks of persons (id, x)."""
    made = [
        {
            "track_id": number,
            "person_id": own,
            "kind": "face",
            "kind_probabilities": {"face": 1},
            "centroid_px": (x, 200),
            "bbox_px": (x - 20, 175, 40, 50),
            "velocity_px_s": (0, 0),
        }
        for number, (own, x) in enumerate(faces)
    ]
    return Tracks(**of_frame(seq, "tracker"), width=640, height=480, tracks=made)


def frame(seq: int) -> Frame:
    return Frame(**of_frame(seq, "camera"), width=640, height=480, encoding="jpeg", data=b"x")


@pytest.mark.parametrize(
    ("yaw", "status", "side"),
    [(0.0, "tracking", None), (-130.0, "tracking", None), (131.0, "out_of_range", "left"), (-150.0, "out_of_range", "right")],
)
def test_a_true_head_has_its_yaw_within_the_range_and_its_side_beyond(yaw: float, status: str, side: str | None) -> None:
    (heads,) = TrueHeads(truth(person(**turned(yaw)))).hear(tracks((7, 321.0)))
    assert isinstance(heads, HeadPoses)
    (pose,) = heads.poses
    assert (pose.person_id, pose.status, pose.side) == (7, status, side)
    assert pose.yaw_deg == (yaw if status == "tracking" else None)
    assert (heads.stage, heads.seq, heads.run) == ("headpose", 0, 1)


def test_only_tracked_persons_get_truth_and_keep_it_when_their_face_is_lost() -> None:
    heads = TrueHeads(truth(person(0, 200.0), person(1, 400.0)))
    (first,) = heads.hear(tracks((4, 401.0)))
    assert isinstance(first, HeadPoses)
    assert [pose.person_id for pose in first.poses] == [4]
    hand_alone = tracks((4, 60.0), seq=1)
    (second,) = heads.hear(hand_alone)
    assert isinstance(second, HeadPoses)
    assert [pose.person_id for pose in second.poses] == [4]
    (nobody,) = heads.hear(tracks((9, 600.0), seq=2))
    assert isinstance(nobody, HeadPoses)
    assert nobody.poses == []
    assert heads.hear(frame(0)) == ()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, ("idle", "none", None)),
        (points(60.0, 55.0), ("stroke", "point_left", 55.0)),
        (points(-60.0, -52.0), ("stroke", "point_right", -52.0)),
        (points(10.0, 12.0), ("stroke", "invisible", 12.0)),
        (points(170.0, 160.0), ("stroke", "invisible", 160.0)),
        (points(60.0), ("stroke", "point_left", 60.0)),
        ({"phase": "preparation", "gesture": "point"}, ("preparation", "none", None)),
        ({"gesture": "wave", "nonpoint_phase": "stroke"}, ("stroke", "other", None)),
        ({"gesture": "wave", "nonpoint_phase": "retraction"}, ("retraction", "none", None)),
    ],
)
def test_a_true_gesture_has_phase_side_and_bearing(changes: dict[str, Any], said: tuple[str, str, float | None]) -> None:
    (message,) = TrueGestures(truth(person(**changes))).hear(tracks((0, 320.0)))
    assert isinstance(message, Gestures)
    (gesture,) = message.gestures
    assert (gesture.phase, gesture.gesture, gesture.bearing_deg) == said


def clip(folder: Path, *persons: dict[str, Any]) -> Clip:
    return Clip("a", folder / "a.mp4", truth(*persons))


def label_pictures(folder: Path) -> None:
    """A left hand of person 0, 30 x 20, that moves by 3 px a frame, and one of person 1."""
    pictures = {}
    for index in range(3):
        labels = np.zeros((480, 640), np.uint8)
        labels[340:360, 380 + 3 * index : 410 + 3 * index] = 4
        labels[100:110, 100:110] = 32 + 4
        pictures[f"f{index:04d}"] = cv2.imencode(".png", labels)[1].ravel()
    np.savez(folder / "a_labels.npz", **pictures)


def test_true_tracks_are_a_face_as_wide_as_fusion_reads_it_and_outlined_hands(tmp_path: Path) -> None:
    label_pictures(tmp_path)
    speaker = TrueTracks(clip(tmp_path, person()))
    assert speaker.has_outlines
    (first,), (second,) = speaker.hear(frame(0)), speaker.hear(frame(1))
    assert isinstance(first, Tracks)
    assert isinstance(second, Tracks)
    face, left, right = first.tracks
    assert face.bbox_px[2] == pytest.approx(500 * FACE_WIDTH_M / 2.0)
    assert face.bbox_px[0] + (face.bbox_px[2] - 1) / 2 == pytest.approx(320)
    assert face.frontal is not None
    assert (left.kind, right.kind) == ("left_hand", "right_hand")
    outline = np.frombuffer(left.contour, "<i2").reshape(-1, 2)
    assert (outline.min(axis=0).tolist(), outline.max(axis=0).tolist()) == ([380, 340], [409, 359])
    assert right.contour == b""  # labelled as visible, but not in the picture
    assert second.tracks[1].velocity_px_s == pytest.approx((90.0, 0.0))


def test_without_label_pictures_hands_are_boxes_and_that_is_said(tmp_path: Path) -> None:
    there = clip(tmp_path, person(), person(1, 900.0))
    (message,) = TrueTracks(there).hear(frame(0))
    assert isinstance(message, Tracks)
    assert {track.person_id for track in message.tracks} == {0}
    assert all(track.contour == b"" and track.bbox_px[2] > 0 for track in message.tracks)
    assert "does not see" in (say_blind([there], ("tracker",)) or "")
    assert say_blind([there], ("headpose",)) is None


def test_stages_are_read_in_the_order_of_the_chain_and_others_are_refused(tmp_path: Path) -> None:
    assert read_stages("gesture, tracker") == ("tracker", "gesture")
    for text in ("fusion", "", "headpose,nose"):
        with pytest.raises(ValueError, match="cannot stand for"):
            read_stages(text)
    speakers = speakers_for(clip(tmp_path, person()), ("tracker", "gesture"), lockstep=True)
    assert [speaker.topic.stage for speaker in speakers] == ["tracker", "gesture"]


def poses_of(way: RobotWay, frames: int) -> list[list[RobotPose]]:
    said = [way.begin(), *(way.hear(frame(seq)) for seq in range(frames))]
    return [[message for message in messages if isinstance(message, RobotPose)] for messages in said]


def test_in_lockstep_every_pose_is_known_before_its_frame() -> None:
    path = [FootPose(0.01 * number, 0.0, 0.5 * number) for number in range(60)]
    fusion = RobotPath(max_age_s=1.0)
    fusion.start_at(RobotPlace())
    poses = poses_of(RobotWay(path, 30, lockstep=True), len(path))
    assert [len(said) for said in poses[:3]] == [AHEAD, 0, 1]
    for seq, said in enumerate(poses[:-1]):
        for pose in said:
            fusion.hear(pose)
        at = fusion.at(frame(seq).stamp_ns)
        assert at.doubt == ""
        assert (at.place.x_m, at.place.yaw_deg) == pytest.approx((path[seq].x_m, path[seq].yaw_deg), abs=1e-6)


def test_at_its_own_rate_the_first_frame_tells_the_stamps() -> None:
    way = RobotWay([FootPose(0.01 * number, 0.0, 0.0) for number in range(60)], 30, lockstep=False)
    assert way.begin() == ()
    first = way.hear(frame(5))
    assert isinstance(first[0], RobotPose)
    assert (first[0].stamp_ns, first[0].x_m, len(first)) == (frame(5).stamp_ns, 0.05, AHEAD)
    assert len(way.hear(frame(8))) == 3


def test_media_time_begins_where_the_camera_lets_it() -> None:
    assert START_NS == LOCKSTEP_EPOCH_NS
